#include <bake/punctual.h>

#include <scene/ies.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dimmer::cook {
namespace {

float window(const PunctualLight& light, float distance_m) {
    if (!light.range_m) return 1;
    const float ratio = distance_m / *light.range_m;
    return std::clamp(1 - ratio * ratio * ratio * ratio, 0.0f, 1.0f);
}

float cone(const PunctualLight& light, glm::vec3 towards_light) {
    // The extension's sample code begins to fall off inside of the inner angle of cones below 2.6 degrees; its text
    // does not.
    constexpr float least = 1e-6f;
    const float scale = 1 / std::max(least, light.cone_inner_cos - light.cone_outer_cos);
    const float cos_angle = glm::dot(light.direction, -towards_light);
    const float attenuation = std::clamp((cos_angle - light.cone_outer_cos) * scale, 0.0f, 1.0f);
    return attenuation * attenuation;
}

}  // namespace

BeamCones beamCones(const PunctualLight& light) {
    if (light.profile)
        return {glm::transpose(light.profile_from_world) * light.profile->beam_axis, light.profile->beam_cos};
    if (light.type == LightType::Spot) return {light.direction, {&light.cone_outer_cos, 1}};
    return {};
}

Illumination illuminate(const PunctualLight& light, glm::vec3 point) {
    if (light.type == LightType::Directional)
        return {-light.direction, std::numeric_limits<float>::infinity(), light.intensity};
    const glm::vec3 to_light = light.position_m - point;
    const float distance_m = glm::length(to_light);
    if (!(distance_m > 0)) return {};
    const glm::vec3 direction = to_light / distance_m;
    const float clamped = std::max(distance_m, lamp_distance_min_m);
    float factor = window(light, distance_m) / (clamped * clamped);
    if (light.type == LightType::Spot) factor *= cone(light, direction);
    if (light.profile) factor *= light.profile->shareTowards(light.profile_from_world * -direction);
    return {direction, distance_m, light.intensity * factor};
}

}  // namespace dimmer::cook
