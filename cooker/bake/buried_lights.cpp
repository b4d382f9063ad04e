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

// A lamp's own casing is no farther from it, a room's walls are.
constexpr float casing_m = 0.5f;

struct Around {
    int backs = 0;     // directions that meet the back of a surface that has but one side
    int casing = 0;    // that meet something opaque within casing_m
    std::string node;  // of the last of these
};

Around lookAround(const RayScene& rays, glm::vec3 place) {
    Around around;
    const Scene& scene = rays.scene();
    for (int i = 0; i < directions; ++i) {
        const auto hit = rays.nearest(place + directionOf(i) * lamp_lift_m, directionOf(i),
                                      std::numeric_limits<float>::infinity(), 0, Surfaces::Walls);
        if (!hit) continue;
        const LevelTriangle& triangle = rays.triangles()[hit->triangle];
        const Material& material = scene.materials[triangle.material];
        around.backs += hit->back && !material.double_sided;
        if (hit->distance_m > casing_m || material.alpha_mode != AlphaMode::Opaque) continue;
        ++around.casing;
        around.node = scene.meshes[triangle.mesh].node;
    }
    return around;
}

}  // namespace

std::vector<std::string> warningsOfBuriedLights(const RayScene& rays) {
    std::vector<std::string> warnings;
    for (const PunctualLight& light : rays.scene().lights) {
        if (light.type == LightType::Directional || light.bake == BakeMode::None) continue;
        const Around around = lookAround(rays, light.position_m);
        if (2 * around.backs <= directions && around.casing == directions)
            warnings.push_back(fmt::format(
                "{}: node '{}': the light is shut in by node '{}', which lets none of it out. It is kept; take it out, "
                "or make that node 'dimmer_lighting' = 'dynamic', which takes its own emission away too",
                rays.scene().file, light.node, around.node));
        if (2 * around.backs <= directions) continue;
        warnings.push_back(
            fmt::format("{}: node '{}': the light lies inside geometry: {} of {} directions meet the back of "
                        "a surface, which blocks it. It is kept; move it, or make what is around it "
                        "'dimmer_lighting' = 'dynamic', which takes its emission away too",
                        rays.scene().file, light.node, around.backs, directions));
    }
    return warnings;
}

}  // namespace dimmer::cook
