// Light groups, which are the sets and what is always on, at the unit of their own brightness. A bake that sees them so
// gives the same light, to the bit, however bright a group is as a whole, and a set of what colour: making it brighter
// is a multiplication.
#pragma once

#include <bake/bake.h>

#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

struct SetScales {
    std::vector<glm::vec3> of_group;        // per light group, linear RGB; 0 where nothing shines
    std::vector<glm::vec3> emission_cd_m2;  // per material of the scene, as the level has it
    std::vector<uint32_t> copy_of;          // per material of the scene, the level's own that it is or is a copy of
};

// Divides the lamps, sky and emissive surfaces of every light group by the group's scale: of a set, per channel, the
// largest punctual intensity (candela or lux) or else the largest radiance (cd/m2); of always-on light the largest of
// all these numbers.
// What is left is rounded to 16 bits of mantissa, an error below 1e-5, so that a level which wrote all of a group's
// lamps 1.3 times as bright gives the same numbers. Materials that sets share are copied.
SetScales divideByScales(Scene& scene);

// Light of a group, back to lux. The falloff over tilted normals is a luminance of the undivided colours: it follows
// E's luminance.
Gathered multiplied(const Gathered& light, glm::vec3 scale);
void multiplyByScales(const SetScales& scales, Baked& baked);

}  // namespace dimmer::cook
