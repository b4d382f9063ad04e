// From radiance to a picture: an eye that adapts, a tone curve, sRGB.
#pragma once

#include "level_renderer.h"

#include <cstdint>
#include <vector>

namespace dimmer::sample {

// Median luminance of a frame in cd/m2, over every pixel that shows any light; 0 when none does.
float medianLuminance(const RadianceFrame& frame);

// Adapts to the median luminance over time, so that a lamp switched off looks dark at first, and never quite fully: a
// dark room stays darker than a bright one.
class AutoExposure {
   public:
    AutoExposure(float adaptation_s, float fps) : adaptation_s_(adaptation_s), frame_s_(1 / fps) {}

    // What radiance is to be multiplied with. `adapted`: the eye has had its time (the first frame, a cut).
    float update(float median_cd_m2, bool adapted);

   private:
    float adaptation_s_, frame_s_;
    float log2_exposure_ = 0;
};

// 8-bit RGB, rows from the top.
std::vector<uint8_t> developPicture(const RadianceFrame& frame, float exposure);

}  // namespace dimmer::sample
