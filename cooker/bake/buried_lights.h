// Lights that stand inside geometry: mostly a mistake of placement, and the light is lost.
#pragma once

#include <trace/ray_scene.h>

#include <string>
#include <vector>

namespace dimmer::cook {

// A warning per point or spot light from which most directions meet the back of a single-sided surface.
std::vector<std::string> warningsOfBuriedLights(const RayScene& rays);

}  // namespace dimmer::cook
