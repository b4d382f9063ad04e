// What a lightmap would lose with longer texels.
#pragma once

#include <charts/texels.h>
#include <charts/unwrap.h>

#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// The light of texels, chart by chart, for trying longer ones on it: a longer texel holds the mean of those that it
// covers, moved as a bake sharpens it, and bilinear filtering shows it. What is lost that way is what edges and bends
// of the light have between texels as they are; light that those do not hold is not known. Charts are tried apart from
// one another, as they lie now.
class CoarserTexels {
   public:
    CoarserTexels() = default;
    // `lux`: per receiver; `face_chart`: Unwrap's; `fixed`: per chart, whether its density stays. The error of a texel
    // is its loss over its light and `floor_lux`.
    CoarserTexels(const Texels& texels, std::span<const uint32_t> face_chart, const std::vector<bool>& fixed,
                  std::span<const float> lux, float floor_lux);

    // Mean over the surface of all texels, `factor` times as long (1 or more). Linear in texels; deterministic.
    double error(double factor) const;

   private:
    double errorOf(size_t chart, double factor) const;

    struct Place {
        uint16_t x, y;  // within the chart
    };
    std::vector<uint32_t> first_;  // per chart that is not fixed, and one more
    std::vector<Place> places_;    // chart by chart
    std::vector<float> lux_, area_m2_;
    float floor_lux_ = 0;
    double all_m2_ = 0;  // with fixed charts
};

}  // namespace dimmer::cook
