#include <dimmer/door.h>
#include <gtest/gtest.h>

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
}

TEST(DoorWeight, SlidingIsTravelOverWidth) {
    EXPECT_EQ(slidingDoorWeight(-0.1f, 0.8f), 0);
    EXPECT_FLOAT_EQ(slidingDoorWeight(0.2f, 0.8f), 0.25f);
    EXPECT_EQ(slidingDoorWeight(1, 0.8f), 1);
    EXPECT_EQ(slidingDoorWeight(0.1f, 0), 1);
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
