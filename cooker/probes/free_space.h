// Where there is air.
#pragma once

#include <trace/ray_scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

inline constexpr float probe_clearance_m = 0.05f;

// In the open: not inside closed geometry or a closed leaf, not outside of the level, not close to a surface: a
// probe there stands for little but that.
// Some rays: a quarter of what they hit may be backs, fronts of doors' leaves aside. `ignored`: a model that is not
// there.
bool inTheOpen(const RayScene& rays, glm::vec3 point_m, uint32_t ignored = no_model,
               float clearance_m = probe_clearance_m);

// In the open and, far from surfaces, chosen: nearer than `near_m` to one all are, elsewhere so many fewer as they are
// farther away. `chance`: the place's own, 0 to 1.
bool chosenInTheOpen(const RayScene& rays, glm::vec3 point_m, float near_m, float chance);

// Random places in the open, evenly over the box of the level's air (probes/air_box.h); fewer where the level has
// hardly any. The same seed gives the same places.
std::vector<glm::vec3> openPlaces(const RayScene& rays, uint32_t count, uint32_t seed);

}  // namespace dimmer::cook
