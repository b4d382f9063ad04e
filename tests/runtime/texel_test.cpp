#include <dimmer/light_state.h>
#include <format/texel.h>
#include <gtest/gtest.h>

#include "random_pack.h"

#include <limits>

namespace dimmer {
namespace {

// From the definition of Vulkan's unsigned 11 and 10 bit floats.
double ufloatValue(uint32_t code, int mantissa_bits) {
    const int exponent = static_cast<int>(code >> mantissa_bits);
    const double mantissa = std::ldexp(code & ((1u << mantissa_bits) - 1), -mantissa_bits);
    return exponent == 0 ? std::ldexp(mantissa, -14) : std::ldexp(1 + mantissa, exponent - 15);
}

// The nearest of all finite codes, ties to the even one.
uint32_t nearestCode(double value, int mantissa_bits) {
    const uint32_t codes = 31u << mantissa_bits;
    uint32_t best = 0;
    for (uint32_t code = 1; code < codes; ++code) {
        const double distance = std::abs(ufloatValue(code, mantissa_bits) - value);
        const double best_distance = std::abs(ufloatValue(best, mantissa_bits) - value);
        if (distance < best_distance || (distance == best_distance && code % 2 == 0)) best = code;
    }
    return best;
}

template <int bits>
void everyFiniteCodeSurvives() {
    for (uint32_t code = 0; code < (31u << bits); ++code) {
        ASSERT_EQ(decodeUfloat<bits>(code), ufloatValue(code, bits)) << code;
        ASSERT_EQ(encodeUfloat<bits>(decodeUfloat<bits>(code)), code);
    }
}

template <int bits>
void roundsToTheNearestCode(uint32_t seed) {
    test::Random random(seed);
    for (int i = 0; i < 3000; ++i) {
        const auto value = std::pow(2.0f, test::uniform(random, -23, 18));
        ASSERT_EQ(encodeUfloat<bits>(value), nearestCode(value, bits)) << value;
    }
    // Ties, and their neighbours on both sides.
    for (uint32_t code = 0; code + 1 < (31u << bits); ++code) {
        const auto middle = static_cast<float>((ufloatValue(code, bits) + ufloatValue(code + 1, bits)) / 2);
        ASSERT_EQ(encodeUfloat<bits>(middle), code + code % 2) << middle;
        ASSERT_EQ(encodeUfloat<bits>(std::nextafter(middle, 0.0f)), code) << middle;
        ASSERT_EQ(encodeUfloat<bits>(std::nextafter(middle, 1e9f)), code + 1) << middle;
    }
}

TEST(Ufloat, EveryFiniteCodeSurvivesDecodingAndEncoding) {
    everyFiniteCodeSurvives<6>();
    everyFiniteCodeSurvives<5>();
}

TEST(Ufloat, RoundsToTheNearestCodeTiesToEven) {
    roundsToTheNearestCode<6>(1);
    roundsToTheNearestCode<5>(2);
}

TEST(Ufloat, WhatIsNoLightBecomesBlackAndTooMuchBecomesTheLargest) {
    const float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    for (float dark : {0.0f, -0.0f, -1.0f, -infinity, nan, -nan, 1e-30f, std::numeric_limits<float>::denorm_min()}) {
        EXPECT_EQ(encodeUfloat<6>(dark), 0u) << dark;
        EXPECT_EQ(encodeUfloat<5>(dark), 0u) << dark;
    }
    for (float bright : {65536.0f, 1e30f, std::numeric_limits<float>::max(), infinity}) {
        EXPECT_EQ(ufloatValue(encodeUfloat<6>(bright), 6), 65024) << bright;
        EXPECT_EQ(ufloatValue(encodeUfloat<5>(bright), 5), 64512) << bright;
    }
}

TEST(Ufloat, ClampTouchesOnlyInfinityAndNan) {
    test::Random random(3);
    for (int i = 0; i < 100000; ++i) {
        const auto code = static_cast<uint32_t>(random());
        const uint32_t r = code & 0x7ff, g = code >> 11 & 0x7ff, b = code >> 22;
        const uint32_t expected =
            std::min(r, 0x7bfu) | std::min(g, 0x7bfu) << 11 | std::min(b, 0x3dfu) << 22;  // codes ascend with value
        ASSERT_EQ(clampR11G11B10(code), expected) << code;
    }
}

// In double, from the definitions: r and m of the bytes, and b = m share / q with q = share d_z kept off the surface.
struct Direction {
    double r, bx, by;
};

Direction directionOf(uint32_t code) {
    const double r = (code & 0xff) / 255.0, share = 1 - r;
    if (share <= 0) return {1, 0, 0};
    const double mx = ((code >> 8 & 0xff) - 128.0) / 127, my = ((code >> 16 & 0xff) - 128.0) / 127;
    const double d_z = std::sqrt(std::max(1 - (mx * mx + my * my) / (share * share), 0.01));
    return {r, mx / d_z, my / d_z};
}

struct Sum {
    double e[3] = {}, l = 0, ambient = 0, bx = 0, by = 0;

    void add(TexelRecord record, Weight w) {
        const double c[3] = {w.r * ufloatValue(record.irradiance & 0x7ff, 6),
                             w.g * ufloatValue(record.irradiance >> 11 & 0x7ff, 6),
                             w.b * ufloatValue(record.irradiance >> 22, 5)};
        const double cl = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        const Direction d = directionOf(record.direction);
        for (int i = 0; i < 3; ++i) e[i] += c[i];
        l += cl;
        ambient += cl * d.r;
        bx += cl * d.bx;
        by += cl * d.by;
    }
};

// Half a step of the format, and what 13 additions in 32-bit floats may lose.
void expectWithinHalfAStep(uint32_t code, int mantissa_bits, double exact) {
    const double step = std::ldexp(1.0, std::max(std::ilogb(std::max(exact, 1e-9)), -14) - mantissa_bits);
    EXPECT_NEAR(ufloatValue(code, mantissa_bits), exact, step / 2 + exact * 2e-6);
}

TEST(TexelBlend, IsWithinHalfAQuantumOfTheSumInDouble) {
    test::Random random(4);
    for (int round = 0; round < 20000; ++round) {
        TexelBlend blend;
        Sum exact;
        for (uint32_t terms = test::pick(random, 1, 13); terms > 0; --terms) {
            const TexelRecord record = test::randomRecord(random, 1.0f / 64);
            const float scalar = test::uniform(random, 0, 2);
            const Weight w = round % 2 ? Weight(scalar) : Weight(scalar, test::uniform(random, 0, 2), 0);
            blend.add(record, w.r, w.g, w.b);
            exact.add(record, w);
        }
        const TexelRecord result = blend.encode();
        expectWithinHalfAStep(result.irradiance & 0x7ff, 6, exact.e[0]);
        expectWithinHalfAStep(result.irradiance >> 11 & 0x7ff, 6, exact.e[1]);
        expectWithinHalfAStep(result.irradiance >> 22, 5, exact.e[2]);
        if (exact.l < 1e-6) continue;  // black: no direction to compare
        // m = (1-r) D_xy / |D| with D = (b, 1-r), all in shares of l. 0.02 of a byte for the floats: their 1e-6 are
        // multiplied by 127, and by up to 10 where the highlight lies along the surface.
        const double r = exact.ambient / exact.l, bx = exact.bx / exact.l, by = exact.by / exact.l;
        const double length = std::sqrt(bx * bx + by * by + (1 - r) * (1 - r));
        const double scale = length > 0 ? (1 - r) / length : 0;
        EXPECT_NEAR(result.direction & 0xff, r * 255, 0.52);
        EXPECT_NEAR(result.direction >> 8 & 0xff, 128 + 127 * bx * scale, 0.52);
        EXPECT_NEAR(result.direction >> 16 & 0xff, 128 + 127 * by * scale, 0.52);
        EXPECT_EQ(result.direction >> 24, 0u);
        if (HasFailure()) FAIL() << "in round " << round;
    }
}

TEST(TexelBlend, OneRecordAtFullWeightKeepsItsIrradianceAndItsDirection) {
    test::Random random(5);
    for (int i = 0; i < 50000; ++i) {
        // A highlight at least 0.1 off the surface, as the cooker stores it; 0.3 leaves room for the bytes' rounding.
        const uint32_t r8 = test::pick(random, 0, 255);
        const double reach = (1 - r8 / 255.0) * std::sqrt(1 - 0.3 * 0.3);
        const double angle = test::uniform(random, 0, 6.2831853f), length = test::uniform(random, 0, 1) * reach;
        const auto x8 = static_cast<uint32_t>(std::lround(128 + 127 * length * std::cos(angle)));
        const auto y8 = static_cast<uint32_t>(std::lround(128 + 127 * length * std::sin(angle)));
        const bool ambient_only = r8 == 255;
        const TexelRecord record{1u + test::randomIrradiance(random, 1.0f / 64),
                                 r8 | (ambient_only ? 128u : x8) << 8 | (ambient_only ? 128u : y8) << 16};
        // With hardly any share left, half a byte of m already exceeds it: then m is cut, and that is right.
        if (r8 > 245 && !ambient_only) continue;
        TexelBlend blend;
        blend.add(record, 1, 1, 1);
        ASSERT_EQ(blend.encode(), record) << std::hex << record.irradiance << " " << record.direction;
    }
}

TEST(TexelBlend, HostileRecordsAndWeightsGiveFiniteCodes) {
    test::Random random(6);
    for (int round = 0; round < 100000; ++round) {
        TexelBlend blend;
        for (uint32_t terms = test::pick(random, 1, 40); terms > 0; --terms) {
            const float w = std::pow(10.0f, test::uniform(random, -44, 38));
            blend.add({static_cast<uint32_t>(random()), static_cast<uint32_t>(random())}, w, w, w);
        }
        const TexelRecord result = blend.encode();
        ASSERT_EQ(clampR11G11B10(result.irradiance), result.irradiance);
        // Undefined conversions of NaN would show here, and under the sanitizer.
        ASSERT_EQ(result.direction >> 24, 0u);
        ASSERT_GE(result.direction >> 8 & 0xff, 1u);
        ASSERT_GE(result.direction >> 16 & 0xff, 1u);
    }
}

}  // namespace
}  // namespace dimmer
