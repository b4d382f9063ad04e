#include <bake/sparse_light.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace dimmer::cook::test {
namespace {

TEST(TermLight, HoldsAnyTermBesideAnyColour) {
    for (const uint32_t term : {0u, 1u, 65535u, 65536u, terms_max - 1})
        for (const glm::vec3 value : {glm::vec3(0), glm::vec3(1, 2, 0.5f), glm::vec3(FLT_MAX, 0, FLT_MAX)})
            for (size_t receiver = 0; receiver < 20; ++receiver) {
                const TermLight light(term, value, Rounding(receiver, Rounding::Of::Bounced));
                EXPECT_EQ(light.term, term);
                EXPECT_EQ(light.in(7).term, 7u);
                EXPECT_EQ(light.in(7).value(), light.value());
                // A float without its lower half is within 2^-7 of it; these but FLT_MAX have none.
                for (glm::length_t c = 0; c < 3; ++c)
                    EXPECT_NEAR(light.value()[c], value[c], value[c] == FLT_MAX ? 0x1p-7f * FLT_MAX : 0);
            }
}

TEST(TermLight, WhatIsNoLightStaysAsItIs) {
    const Rounding rounding(3, Rounding::Of::Direct);
    EXPECT_EQ(TermLight(0, glm::vec3(-1), rounding).value(), glm::vec3(0));
    const float infinity = std::numeric_limits<float>::infinity();
    EXPECT_EQ(TermLight(0, glm::vec3(infinity), rounding).value(), glm::vec3(infinity));
    EXPECT_TRUE(std::isnan(TermLight(0, glm::vec3(NAN), rounding).value().x));
}

// By the rounding of one receiver, brighter light is never held to be darker; nor is any off by a step of its format.
TEST(TermLight, RoundsAlikeAndByLessThanAStep) {
    const Rounding rounding(11, Rounding::Of::Outgoing);
    glm::vec3 before(0);
    for (float x = 1e-6f; x < 1e6f; x *= 1.0007f) {
        const glm::vec3 value = TermLight(0, glm::vec3(x), rounding).value();
        for (glm::length_t c = 0; c < 3; ++c) {
            EXPECT_GE(value[c], before[c]);
            EXPECT_LT(std::abs(value[c] - x), 0x1p-7f * x);
        }
        before = value;
    }
}

// Of many receivers' the mean is the light itself, also where it was rounded before as another kind of light.
TEST(TermLight, IsRightInTheMean) {
    constexpr int receivers = 100'000;
    for (const float x : {1.0f, 1.001f, 1.3f, 0.7f * 1.99f, 3.14159e-5f, 87654.3f}) {
        glm::dvec3 once(0), twice(0);
        for (size_t i = 0; i < receivers; ++i) {
            const TermLight light(0, glm::vec3(x), Rounding(i, Rounding::Of::Bounced));
            once += light.value();
            twice += TermLight(0, 0.9f * light.value(), Rounding(i, Rounding::Of::Outgoing)).value();
        }
        // Four standard errors of at most half a step of 2^-7, of which there are two.
        const double tolerance = 4 * 0x1p-8 * std::sqrt(2.0 / receivers);
        for (glm::length_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(once[c] / receivers / static_cast<double>(x), 1, tolerance) << x;
            EXPECT_NEAR(twice[c] / receivers / (0.9 * static_cast<double>(x)), 1, tolerance) << x;
        }
    }
}

}  // namespace
}  // namespace dimmer::cook::test
