#include <game_sample/exposure.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/packing.hpp>

namespace dimmer::sample {
namespace {

RadianceFrame makeFrame(const std::vector<float>& greys) {
    RadianceFrame frame{static_cast<uint32_t>(greys.size()), 1, {}};
    for (const float grey : greys)
        for (int channel = 0; channel < 4; ++channel) frame.rgba.push_back(glm::packHalf1x16(grey));
    return frame;
}

TEST(SampleExposure, MedianIgnoresPixelsWithoutLight) {
    std::vector<float> greys(3000, 0.0f);
    for (size_t i = 0; i < 300; ++i) greys[i] = 2;
    for (size_t i = 300; i < 900; ++i) greys[i] = 8;
    EXPECT_FLOAT_EQ(medianLuminance(makeFrame(greys)), 8);
    EXPECT_EQ(medianLuminance(makeFrame({0, 0, 0})), 0);
}

TEST(SampleExposure, ApproachesItsTargetWithTheTimeConstant) {
    AutoExposure exposure(2.0f, 10.0f);  // 2 s at 10 frames a second
    const float bright = std::log2(exposure.update(64, true));
    AutoExposure other(2.0f, 10.0f);
    const float dark = std::log2(other.update(1, true));
    EXPECT_GT(dark, bright);
    float now = bright;
    for (int frame = 0; frame < 20; ++frame) now = std::log2(exposure.update(1, false));
    // After one time constant 1/e of the way is left.
    EXPECT_NEAR((dark - now) / (dark - bright), std::exp(-1.0f), 1e-3);
}

TEST(SampleExposure, DarkScenesStayDarker) {
    AutoExposure bright(1, 30), dark(1, 30);
    EXPECT_GT(bright.update(16, true) * 16, dark.update(1, true) * 1);
}

TEST(SampleExposure, BlackIsBlackBrightIsWhiteAndAllIsMonotonic) {
    const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    const auto picture = developPicture(makeFrame({0, 0.01f, 0.1f, 0.18f, 1, 10, 60000, inf, -1, nan}), 1);
    const auto grey = [&](size_t i) { return picture[i * 3]; };
    EXPECT_EQ(grey(0), 0);
    for (size_t i = 1; i < 6; ++i) EXPECT_GT(grey(i), grey(i - 1)) << i;
    EXPECT_EQ(grey(6), 255);
    EXPECT_EQ(grey(7), 255);
    EXPECT_EQ(grey(8), 0);
    EXPECT_EQ(grey(9), 0);
    // 0.18 by hand: (0.18 (2.51 * 0.18 + 0.03)) / (0.18 (2.43 * 0.18 + 0.59) + 0.14) = 0.2669; sRGB: 0.5538 * 255.
    EXPECT_NEAR(grey(3), 141, 1);
}

TEST(SampleExposure, ComesBackFromABlaze) {
    AutoExposure exposure(1, 30);
    EXPECT_GT(exposure.update(std::numeric_limits<float>::infinity(), true), 0.0f);
    float now = 0;
    for (int frame = 0; frame < 300; ++frame) now = exposure.update(4, false);
    AutoExposure rested(1, 30);
    EXPECT_NEAR(now / rested.update(4, true), 1, 1e-2);  // ten time constants
}

}  // namespace
}  // namespace dimmer::sample
