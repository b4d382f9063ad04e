#include "fly_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dimmer::sample {
namespace {

constexpr float walking_m_s = 2.5f;
constexpr float pitch_max_rad = 0.49f * std::numbers::pi_v<float>;

}  // namespace

CameraPose fly(const CameraPose& from, const FlyInput& input, float seconds) {
    CameraPose to = from;
    const float pitch = std::clamp(std::asin(std::clamp(from.forward.y, -1.0f, 1.0f)) + input.turn_rad.y,
                                   -pitch_max_rad, pitch_max_rad);
    // Straight down there is no heading to keep.
    const bool upright = std::abs(from.forward.x) + std::abs(from.forward.z) < 1e-6f;
    const float heading = (upright ? 0 : std::atan2(from.forward.x, -from.forward.z)) + input.turn_rad.x;
    to.forward = {std::cos(pitch) * std::sin(heading), std::sin(pitch), -std::cos(pitch) * std::cos(heading)};
    const glm::vec3 right{std::cos(heading), 0, std::sin(heading)};
    glm::vec3 way = right * input.move.x + glm::vec3(0, input.move.y, 0) + to.forward * input.move.z;
    // Two keys at once are no faster than one.
    way /= std::max(1.0f, glm::length(way));
    to.position_m += way * (walking_m_s * input.faster * seconds);
    return to;
}

}  // namespace dimmer::sample
