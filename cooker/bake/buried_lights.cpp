#include <bake/buried_lights.h>

#include <bake/punctual.h>

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace dimmer::cook {
namespace {

constexpr int directions = 64;

// Evenly over the sphere: a spiral of equal steps in height and golden angles.
glm::vec3 directionOf(int i) {
    const double z = 1 - (2 * i + 1.0) / directions, r = std::sqrt(1 - z * z);
    const double turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    return glm::dvec3(r * std::cos(turn), r * std::sin(turn), z);
}

int backsAround(const RayScene& rays, glm::vec3 place) {
    int backs = 0;
    for (int i = 0; i < directions; ++i) {
        const auto hit = rays.nearest(place + directionOf(i) * lamp_lift_m, directionOf(i),
                                      std::numeric_limits<float>::infinity(), 0, Surfaces::Walls);
        if (!hit || !hit->back) continue;
        backs += !rays.scene().materials[rays.triangles()[hit->triangle].material].double_sided;
    }
    return backs;
}

}  // namespace

std::vector<std::string> warningsOfBuriedLights(const RayScene& rays) {
    std::vector<std::string> warnings;
    for (const PunctualLight& light : rays.scene().lights) {
        if (light.type == LightType::Directional || light.bake == BakeMode::None) continue;
        const int backs = backsAround(rays, light.position_m);
        if (2 * backs <= directions) continue;
        warnings.push_back(
            fmt::format("{}: node '{}': the light lies inside geometry: {} of {} directions meet the back of "
                        "a surface, which blocks it. It is kept; move it, or make what is around it "
                        "'dimmer_lighting' = 'dynamic'",
                        rays.scene().file, light.node, backs, directions));
    }
    return warnings;
}

}  // namespace dimmer::cook
