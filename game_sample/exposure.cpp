#include "exposure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/packing.hpp>

namespace dimmer::sample {
namespace {

constexpr float middle_grey = 0.18f;
// An evening's interior: what the eye takes for normal. A median elsewhere is made up for to this share, in stops.
constexpr float usual_cd_m2 = 4.0f;
constexpr float adaptation_share = 0.6f;
// Darker than this the eye gives up; also keeps a black frame from asking for infinite exposure.
constexpr float darkest_cd_m2 = 0.02f;
// What a picture of 16-bit floats holds: brighter than this it says infinite, from which no mean would come back.
constexpr float brightest_cd_m2 = 65504.0f;

constexpr size_t median_stride = 3;  // pixels; a third of them gives the same median to a hundredth of a stop

glm::vec3 radiance(const RadianceFrame& frame, size_t pixel) {
    const uint16_t* half = &frame.rgba[pixel * 4];
    return {glm::unpackHalf1x16(half[0]), glm::unpackHalf1x16(half[1]), glm::unpackHalf1x16(half[2])};
}

// K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2016: a fit of the film-like reference curve.
float toneCurve(float x) {
    return std::clamp(x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f), 0.0f, 1.0f);
}

// IEC 61966-2-1.
float encodeSrgb(float linear) {
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

// Tone curve and sRGB for every 16-bit float: 65536 entries instead of three powers per pixel.
std::array<uint8_t, 65536> developTable(float exposure) {
    std::array<uint8_t, 65536> table{};
    for (size_t half = 0; half < table.size(); ++half) {
        const float value = glm::unpackHalf1x16(static_cast<uint16_t>(half));
        if (!(value > 0)) continue;  // zero, negative, NaN
        const float mapped = std::isinf(value) ? 1.0f : toneCurve(value * exposure);
        table[half] = static_cast<uint8_t>(encodeSrgb(mapped) * 255 + 0.5f);
    }
    return table;
}

}  // namespace

float medianLuminance(const RadianceFrame& frame) {
    std::vector<float> luminances;
    const size_t pixels = size_t(frame.width) * frame.height;
    luminances.reserve(pixels / median_stride + 1);
    for (size_t pixel = 0; pixel < pixels; pixel += median_stride) {
        const float luminance = glm::dot(radiance(frame, pixel), glm::vec3(0.2126f, 0.7152f, 0.0722f));
        if (luminance > 0) luminances.push_back(luminance);
    }
    if (luminances.empty()) return 0;
    const auto middle = luminances.begin() + static_cast<std::ptrdiff_t>(luminances.size() / 2);
    std::nth_element(luminances.begin(), middle, luminances.end());
    return *middle;
}

float AutoExposure::update(float median_cd_m2, bool adapted) {
    const float stops_from_usual = std::log2(std::clamp(median_cd_m2, darkest_cd_m2, brightest_cd_m2) / usual_cd_m2);
    const float target = std::log2(middle_grey / usual_cd_m2) - adaptation_share * stops_from_usual;
    const float share = adapted || !(adaptation_s_ > 0) ? 1.0f : 1 - std::exp(-frame_s_ / adaptation_s_);
    log2_exposure_ += share * (target - log2_exposure_);
    return std::exp2(log2_exposure_);
}

std::vector<uint8_t> developPicture(const RadianceFrame& frame, float exposure) {
    const auto table = developTable(exposure);
    const size_t pixels = size_t(frame.width) * frame.height;
    std::vector<uint8_t> picture(pixels * 3);
    for (size_t pixel = 0; pixel < pixels; ++pixel)
        for (size_t channel = 0; channel < 3; ++channel)
            picture[pixel * 3 + channel] = table[frame.rgba[pixel * 4 + channel]];
    return picture;
}

}  // namespace dimmer::sample
