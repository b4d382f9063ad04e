// Point, spot and directional lights.
#pragma once

#include <scene/scene.h>
#include <trace/ray_scene.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <span>

namespace dimmer::cook {

// Nearer than this a lamp shines as from there: it is no point.
inline constexpr float lamp_distance_min_m = 1e-3f;

struct Illumination {
    glm::vec3 towards_light{0};   // unit
    float distance_m = 0;         // infinite for a directional light
    glm::vec3 irradiance_lux{0};  // on a surface that faces the light, nothing between
};

// Rays to and from lamps leave out so much beside them: one that lies in a surface, a ceiling's say, shines from it.
inline constexpr float lamp_lift_m = 5e-4f;

// How far a shadow ray goes.
inline float shadowRayLengthM(const Illumination& lit) {
    return std::isinf(lit.distance_m) ? far_away_m : std::max(0.0f, lit.distance_m - lamp_lift_m);
}

// The cones that a lamp's light is narrow in, about an axis: cosines of their half angles, from the narrowest on. A
// spot has one, which holds all of it; a measured luminaire as many as its profile's beam.
struct BeamCones {
    glm::vec3 axis{0, 0, -1};
    std::span<const float> cosines;
};
BeamCones beamCones(const PunctualLight& light);

// What `light` does at `point`. Inverse square with a least distance of 1 mm, windowed by the range; spots by the glTF
// cone formula (KHR_lights_punctual); measured luminaires by their profile (EXT_lights_ies).
Illumination illuminate(const PunctualLight& light, glm::vec3 point);

}  // namespace dimmer::cook
