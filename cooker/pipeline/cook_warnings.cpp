#include <pipeline/cook_warnings.h>

#include <fmt/format.h>

#include <algorithm>

namespace dimmer::cook {

std::optional<std::string> coarseExposure(const Scene& scene, float exposure) {
    constexpr float smallest = 0x1p-14f;  // what both colour formats store with a step of a few per cent
    constexpr float dark_lux = 1;
    const float lost_lux = smallest / exposure;
    if (lost_lux <= dark_lux) return {};
    const auto sets = std::span(scene.light_sets);
    const auto largest = std::ranges::max_element(sets, {}, &SceneLightSet::max_weight);
    const std::string cause = largest != sets.end() && largest->max_weight > 1
                                  ? fmt::format(
                                        "light set '{}' has a dimmer_max_weight of {:.3g}; give it the largest that "
                                        "the game sets",
                                        largest->name, largest->max_weight)
                                  : "some light is that bright; correct its intensity";
    return fmt::format(
        "{}: light below {:.3g} lux is stored coarsely or as black, to leave room for all sets at their "
        "largest weight: {}",
        scene.file, lost_lux, cause);
}

std::optional<std::string> farFromOrigin(const RayScene& rays) {
    // A step of floats is 0.24 mm from here on, and points of surfaces lie four of them off (liftOff()), not 0.5 mm.
    constexpr float far_m = 2048;
    const glm::vec3 farthest = glm::max(glm::abs(rays.boundsMin()), glm::abs(rays.boundsMax()));
    const float most_m = std::max({farthest.x, farthest.y, farthest.z});
    if (most_m <= far_m) return {};
    return fmt::format(
        "{}: reaches {:.0f} m from the origin: beyond {:.0f} m walls are placed ever more coarsely, and lit less "
        "rightly; "
        "put the level's middle at the origin, or cook it in parts",
        rays.scene().file, most_m, far_m);
}

std::optional<std::string> withoutLight(const Scene& scene) {
    const auto glows = [](const Material& m) { return m.emission_cd_m2 != glm::vec3(0); };
    if (!scene.lights.empty() || scene.sky_radiance_cd_m2 != glm::vec3(0) ||
        std::ranges::any_of(scene.materials, glows))
        return {};
    return scene.file +
           ": has no light, and all of it comes out black; export it with punctual lights, or give it a sky or a "
           "material that shines";
}

std::vector<std::string> otherQualities(const Profile& profile, const std::string& quality) {
    std::vector<std::string> warnings;
    for (const auto& [key, origin] : profile.origin)
        if (origin == "command line" && key.starts_with("bake.") && !key.starts_with("bake." + quality + "."))
            warnings.push_back(fmt::format("--set {}: does nothing at quality '{}'", key, quality));
    return warnings;
}

}  // namespace dimmer::cook
