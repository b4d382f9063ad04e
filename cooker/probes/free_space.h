// Where there is air.
#pragma once

#include <trace/ray_scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

// In the open: not inside closed geometry or a closed leaf, not outside of the level, not close to a surface: a
// probe there stands for little but that.
// Some rays: a quarter of what they hit may be backs, fronts of doors' leaves aside. `ignored`: a model that is not
// there.
bool inTheOpen(const RayScene& rays, glm::vec3 point_m, uint32_t ignored = no_model, float clearance_m = 0.05f);

// Random places in the open, evenly over the level's box; fewer where the level has hardly any. The same seed gives the
// same places.
std::vector<glm::vec3> openPlaces(const RayScene& rays, uint32_t count, uint32_t seed);

}  // namespace dimmer::cook
