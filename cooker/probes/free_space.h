// Where there is air.
#pragma once

#include <trace/ray_scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

// In the open: not inside closed geometry or a closed leaf, not outside of the level, not within 5 cm of a surface.
// Some rays: a quarter of what they hit may be backs.
bool inTheOpen(const RayScene& rays, glm::vec3 point_m);

// Random places in the open, evenly over the level's box; fewer where the level has hardly any. The same seed gives the
// same places.
std::vector<glm::vec3> openPlaces(const RayScene& rays, uint32_t count, uint32_t seed);

}  // namespace dimmer::cook
