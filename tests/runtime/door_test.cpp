#include <dimmer/door.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace dimmer::test {
namespace {

constexpr float pi = std::numbers::pi_v<float>;

TEST(DoorWeight, HingedFollowsWhatTheLeafUncovers) {
    EXPECT_EQ(hingedDoorWeight(0, pi / 2), 0);
    EXPECT_FLOAT_EQ(hingedDoorWeight(pi / 3, pi / 2), 0.5f);  // 1 - cos 60 degrees
    EXPECT_FLOAT_EQ(hingedDoorWeight(-pi / 3, pi / 2), 0.5f);
    EXPECT_FLOAT_EQ(hingedDoorWeight(pi / 2, pi / 2), 1);
    EXPECT_FLOAT_EQ(hingedDoorWeight(pi / 2, pi), 0.5f);
    EXPECT_EQ(hingedDoorWeight(3, pi / 2), 1);
    EXPECT_EQ(hingedDoorWeight(0.1f, 0), 1);
    EXPECT_EQ(hingedDoorWeight(0, 0), 0);
    // A leaf hinged on the other side jumped open.
    EXPECT_FLOAT_EQ(hingedDoorWeight(-pi / 3, -pi / 2), 0.5f);
    EXPECT_FLOAT_EQ(hingedDoorWeight(pi / 3, -pi / 2), 0.5f);
}

// Against the cosines in double, whose own cancellation is 1e-16 of 1 - cos 0.01 = 5e-5: nothing beside a float's.
TEST(DoorWeight, HingedIsTheFormulaForSmallAnglesToo) {
    for (const float max : {0.01f, 0.3f, 1.0f, 1.9f, pi})
        for (const float share : {0.01f, 0.1f, 0.5f, 0.9f, 0.999f}) {
            const float angle = share * max;
            const double expected =
                (1 - std::cos(static_cast<double>(angle))) / (1 - std::cos(static_cast<double>(max)));
            // Two sines, a quotient and a square, each to 6e-8 or the double of it.
            EXPECT_NEAR(hingedDoorWeight(angle, max), expected, 5e-7 * expected) << angle << " of " << max;
        }
    // Where the float's cosine is 1: the square of the share, to the fourth order of the angle, 1e-16.
    EXPECT_NEAR(hingedDoorWeight(0.5e-4f, 1e-4f), 0.25f, 5e-7 * 0.25);
}

TEST(DoorWeight, HingedStaysClosedHoweverLittleItTurns) {
    for (const float max : {1e-4f, 1e-20f, std::numeric_limits<float>::denorm_min()})
        EXPECT_EQ(hingedDoorWeight(0, max), 0) << max;
}

TEST(DoorWeight, HingedOfNoNumberIsNone) {
    for (const float max : {1.0f, 0.0f}) EXPECT_TRUE(std::isnan(hingedDoorWeight(NAN, max))) << max;
    EXPECT_TRUE(std::isnan(hingedDoorWeight(1, NAN)));
}

TEST(DoorWeight, SlidingIsTravelOverWidth) {
    EXPECT_EQ(slidingDoorWeight(-0.1f, 0.8f), 0);
    EXPECT_FLOAT_EQ(slidingDoorWeight(0.2f, 0.8f), 0.25f);
    EXPECT_EQ(slidingDoorWeight(1, 0.8f), 1);
    EXPECT_EQ(slidingDoorWeight(0.1f, 0), 1);
    EXPECT_FLOAT_EQ(slidingDoorWeight(-0.2f, -0.8f), 0.25f);
    EXPECT_EQ(slidingDoorWeight(0.2f, -0.8f), 0);
    EXPECT_FALSE(std::signbit(slidingDoorWeight(0, -0.8f)));
    EXPECT_TRUE(std::isnan(slidingDoorWeight(NAN, 0.8f)));
    EXPECT_TRUE(std::isnan(slidingDoorWeight(0.2f, NAN)));
}

// Weights are what setDoor accepts, and never step back, in 256 steps of either.
TEST(DoorWeight, StaysWithinZeroAndOneAndNeverTurnsBack) {
    float hinged = 0, sliding = 0;
    for (int i = 0; i <= 256; ++i) {
        const float share = static_cast<float>(i) / 256;
        const float h = hingedDoorWeight(share * 1.9f, 1.9f), s = slidingDoorWeight(share * 1.3f, 1.3f);
        EXPECT_GE(h, hinged);
        EXPECT_GE(s, sliding);
        EXPECT_LE(std::max(h, s), 1);
        hinged = h;
        sliding = s;
    }
    EXPECT_EQ(hinged, 1);
    EXPECT_EQ(sliding, 1);
}

}  // namespace
}  // namespace dimmer::test
