// From gathered light to stored texels.
#pragma once

#include <bake/bake.h>
#include <pack/pack_data.h>

#include <span>

namespace dimmer::cook {

// The "ahd" model fitted to a texel's moments: ambient share and highlight. Of an ambient share r and a single
// direction d, the cosine-weighted mean direction of the light is c = r (0, 0, 2/3) + (1 - r) d; with |d| = 1 that is
// solved for r in closed form. What is really ambient plus one direction is recovered exactly, and E(+Z) always is.
struct HighlightFit {
    float ambient = 1;
    glm::vec3 direction{0, 0, 1};  // unit, z >= highlight_z_min
};
HighlightFit fitHighlight(const Gathered& light);

TexelRecord encodeTexel(const Gathered& light, float exposure, ColorFormat format);

// The power of two that keeps the largest value reachable with every weight at its maximum below half of the format's
// largest number. `max_weights`: per light group, 1 for always-on light.
float chooseExposure(const Baked& baked, std::span<const float> max_weights);

}  // namespace dimmer::cook
