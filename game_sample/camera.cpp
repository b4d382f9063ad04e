#include "camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <string>

namespace dimmer::sample {
namespace {

constexpr std::string_view player_start = "player_start";
constexpr float near_m = 0.05f, far_m = 500.0f;

CameraPose cornerOfBounds(const Pack& pack) {
    glm::vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    for (const Mesh& mesh : pack.meshes())
        for (const MeshVertex& vertex : mesh.vertices) {
            low = glm::min(low, toVec3(vertex.position_m));
            high = glm::max(high, toVec3(vertex.position_m));
        }
    if (low.x > high.x) return {};
    const glm::vec3 middle = (low + high) * 0.5f;
    const glm::vec3 eye = middle + (high - middle) * 0.9f;
    const glm::vec3 towards = middle - eye;
    return {eye, glm::length(towards) > 0 ? glm::normalize(towards) : glm::vec3(0, 0, -1), 1.0f};
}

}  // namespace

CameraPose poseOf(const Viewpoint& viewpoint) {
    return {toVec3(viewpoint.position_m), toVec3(viewpoint.forward), viewpoint.vertical_fov_rad};
}

Expected<CameraPose> findCamera(const Pack& pack, std::string_view name) {
    std::string names;
    for (const Viewpoint& viewpoint : pack.viewpoints()) {
        if (viewpoint.name == name) return poseOf(viewpoint);
        names += (names.empty() ? "" : ", ") + viewpoint.name;
    }
    return fail(ErrorCode::NotFound, fmt::format("The pack has no camera \"{}\". It has: {}.", name,
                                                 names.empty() ? "none; give a place, x y z look x y z" : names));
}

CameraPose defaultCamera(const Pack& pack) {
    const auto viewpoints = pack.viewpoints();
    const auto camera =
        std::find_if(viewpoints.begin(), viewpoints.end(), [](const auto& v) { return v.name != player_start; });
    if (camera != viewpoints.end()) return poseOf(*camera);
    return viewpoints.empty() ? cornerOfBounds(pack) : poseOf(viewpoints.front());
}

CameraPose blend(const CameraPose& from, const CameraPose& to, float t) {
    const float eased = t * t * (3 - 2 * t);
    glm::vec3 forward = glm::mix(from.forward, to.forward, eased);
    // Opposite directions pass through nothing: jump there instead of dividing by zero.
    forward = glm::length(forward) > 1e-3f ? glm::normalize(forward) : to.forward;
    return {glm::mix(from.position_m, to.position_m, eased), forward,
            glm::mix(from.vertical_fov_rad, to.vertical_fov_rad, eased)};
}

glm::mat4 clipFromWorld(const CameraPose& camera, float aspect) {
    // Looking straight up or down, +Y is no "up" any more.
    const glm::vec3 up = std::abs(camera.forward.y) > 0.999f ? glm::vec3(0, 0, -1) : glm::vec3(0, 1, 0);
    const glm::mat4 view_from_world = glm::lookAtRH(camera.position_m, camera.position_m + camera.forward, up);
    glm::mat4 clip_from_view = glm::perspectiveRH_ZO(camera.vertical_fov_rad, aspect, near_m, far_m);
    clip_from_view[1][1] = -clip_from_view[1][1];  // Vulkan's clip space has y down
    return clip_from_view * view_from_world;
}

}  // namespace dimmer::sample
