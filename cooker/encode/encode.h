// From gathered light to stored texels.
#pragma once

#include <bake/bake.h>
#include <format/texel.h>
#include <pack/pack_data.h>

#include <span>

namespace dimmer::cook {

// The directional model whose falloff comes closest, in least squares, to the light's own on the four tilted normals;
// E(+Z) is exact in any case. What lies below the surface counts as dark. Cost: at most 16 rounds of some 100 flops.
Highlight fitHighlight(const Gathered& light, DirectionModel model);

struct TexelEncoding {
    float exposure = 1;
    ColorFormat color_format = ColorFormat::R11G11B10F;
    DirectionModel direction_model = DirectionModel::Ahd;
};
TexelRecord encodeTexel(const Gathered& light, const TexelEncoding& encoding);

// The power of two that keeps every record, and the largest value reachable with every weight at its maximum, below
// half of the format's largest number. `max_weights`: per term, that of its light set; 1 for always-on light.
float chooseExposure(const Baked& baked, std::span<const float> max_weights);
// Whose light at its largest weight is the brightest of all at some place: the exposure is its doing.
uint32_t brightestTerm(const Baked& baked, std::span<const float> max_weights);

}  // namespace dimmer::cook
