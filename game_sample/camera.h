// Where the sample looks from.
#pragma once

#include <dimmer/error.h>
#include <dimmer/pack.h>

#include <array>
#include <glm/glm.hpp>
#include <string_view>

namespace dimmer::sample {

inline glm::vec3 toVec3(const std::array<float, 3>& v) {
    return {v[0], v[1], v[2]};
}

struct CameraPose {
    glm::vec3 position_m{0};
    glm::vec3 forward{0, 0, -1};  // unit, world space, +Y up
    float vertical_fov_rad = 1.0f;
};

// The viewpoint of that name; NotFound lists those that there are.
Expected<CameraPose> findCamera(const Pack& pack, std::string_view name);

CameraPose poseOf(const Viewpoint& viewpoint);

// Where to look from when nobody says: the first camera of the level, else its player_start, else from a corner of the
// level's bounds towards its middle.
CameraPose defaultCamera(const Pack& pack);

// `t` 0..1, eased at both ends.
CameraPose blend(const CameraPose& from, const CameraPose& to, float t);

// Vulkan's clip space (y down, depth 0..1) from world space. `aspect` is width / height.
glm::mat4 clipFromWorld(const CameraPose& camera, float aspect);

}  // namespace dimmer::sample
