// Light sets at the unit of their own brightness. A bake that sees them so gives the same light, to the bit, however
// bright and of what colour a set is as a whole: making it brighter is a multiplication.
#pragma once

#include <bake/bake.h>

#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

struct SetScales {
    std::vector<glm::vec3> of_group;        // per light group, linear RGB; 1 for always-on light
    std::vector<glm::vec3> emission_cd_m2;  // per material of the scene, as the level has it
    std::vector<uint32_t> copy_of;          // per material of the scene, the level's own that it is or is a copy of
};

// Divides the lamps and emissive surfaces of every light set by the set's scale: per channel the largest punctual
// intensity (candela or lux), or without lamps the largest radiance (cd/m2). What is left is rounded to 16 bits of
// mantissa, an error below 1e-5, so that a level which wrote all of a set's lamps 1.3 times as bright gives the same
// numbers. Materials that sets share are copied.
SetScales divideByScales(Scene& scene);

// Back to lux. The falloff over tilted normals is a luminance of the undivided colours: it follows E's luminance.
void multiplyByScales(const SetScales& scales, Baked& baked);

}  // namespace dimmer::cook
