#include <pipeline/cook_warnings.h>

#include <bake/door_paths.h>
#include <bake/punctual.h>
#include <bake/sampling.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dimmer::cook {
namespace {

// The middle one of its box's sides.
float widthM(const SceneMesh& mesh) {
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const glm::vec3& p : mesh.positions_m) low = glm::min(low, p), high = glm::max(high, p);
    const glm::vec3 side = high - low;
    return std::max(std::min(side.x, side.y), std::min(std::max(side.x, side.y), side.z));
}

}  // namespace

std::optional<std::string> coarseExposure(const Scene& scene, float exposure, uint32_t group) {
    constexpr float smallest = 0x1p-14f;  // what both colour formats store with a step of a few per cent
    constexpr float dark_lux = 1;
    const float lost_lux = smallest / exposure;
    if (lost_lux <= dark_lux) return {};
    std::string cause = "light that is always on is that bright; correct its intensity";
    if (group != always_group) {
        const SceneLightSet& set = scene.light_sets[group - 1];
        cause = fmt::format("light set '{}' is that bright; correct its intensity", set.name);
        if (set.max_weight > 1)
            cause +=
                fmt::format(", or its dimmer_max_weight of {:.3g}, if that is more than the game sets", set.max_weight);
    }
    return fmt::format(
        "{}: light below {:.3g} lux is stored coarsely or as black, to leave room for all sets at their largest "
        "weight: "
        "{}",
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

std::optional<std::string> allInTheDark(const RayScene& rays, const Unwrap& unwrap, const Texels& texels,
                                        double energy_lm) {
    const Scene& scene = rays.scene();
    if (energy_lm > 0 || withoutLight(scene)) return {};
    const auto lights = [&](const PunctualLight& light, size_t texel) {
        const SamplePoint p = samplePoint(rays, unwrap, texels, texel, 0);
        const Illumination lit = illuminate(light, p.position_m);
        return luminance(lit.irradiance_lux) * glm::dot(lit.towards_light, unwrap.frames[p.face].normal) > 0 &&
               rays.transmittance(p.position_m, lit.towards_light, shadowRayLengthM(lit), Surfaces::Walls) > 0;
    };
    for (const PunctualLight& light : scene.lights)
        for (size_t i = 0; i < texels.size(); ++i)
            if (lights(light, i)) return {};  // which renderers draw, and nothing reflects
    return scene.file +
           ": none of its light arrives at any surface with a lightmap, and all of it comes out black; something may "
           "enclose the level (a dome of sky blocks the sun: 'dimmer_lighting': 'dynamic' leaves it out), or its "
           "lights have an intensity of 0";
}

std::optional<std::string> tooSmallForTexels(const RayScene& rays, const Unwrap& unwrap, const Texels& texels) {
    const Scene& scene = rays.scene();
    constexpr float least_level_m = 1.5f;
    const glm::vec3 size = rays.boundsMax() - rays.boundsMin();
    if (std::max({size.x, size.y, size.z}) < least_level_m)
        return fmt::format(
            "{}: is {:.2f} x {:.2f} x {:.2f} m large, smaller than a person: is the level in metres, as glTF has it?",
            scene.file, size.x, size.y, size.z);
    constexpr uint32_t padding = 1, few_texels = 3;
    std::vector<float> widths_m;  // of meshes: of ground in fine triangles charts are narrow, and it is not
    for (const SceneMesh& mesh : scene.meshes) widths_m.push_back(widthM(mesh));
    double all_m2 = 0, narrow_m2 = 0;
    for (size_t i = 0; i < texels.size(); ++i) {
        const uint32_t face = texels.face(i);
        const Chart& chart = unwrap.charts[unwrap.face_chart[face]];
        const float width_m = widths_m[rays.triangles()[unwrap.faces[face].triangle].mesh];
        all_m2 += static_cast<double>(texels.area_m2[i]);
        if (std::min(chart.width, chart.height) < few_texels + 2 * padding &&
            width_m < static_cast<float>(few_texels) * std::sqrt(unwrap.texel_area_m2[face]))
            narrow_m2 += static_cast<double>(texels.area_m2[i]);
    }
    if (!(narrow_m2 > 0.5 * all_m2)) return {};
    return fmt::format(
        "{}: most of its surface lies on walls of less than {} texels' width, through which light leaks: is the level "
        "in metres, as glTF has it? If so, take more texels per metre (lightmaps.texels_per_metre)",
        scene.file, few_texels);
}

std::optional<std::string> tooLargeForTexels(const RayScene& rays, const Unwrap& unwrap) {
    constexpr double texels_min = 1e6, texels_per_face = 10'000;  // of real levels' faces: hundreds
    double texels = 0;
    for (size_t f = 0; f < unwrap.faces.size(); ++f) {
        const uint32_t t = unwrap.faces[f].triangle;
        const glm::vec3 a = rays.corner(t, 0);
        const float area_m2 = glm::length(glm::cross(rays.corner(t, 1) - a, rays.corner(t, 2) - a)) / 2;
        // A sliver may have no area left on its page.
        if (unwrap.texel_area_m2[f] > 0) texels += static_cast<double>(area_m2 / unwrap.texel_area_m2[f]);
    }
    const auto faces = static_cast<double>(unwrap.faces.size());
    if (texels < texels_min || texels < texels_per_face * faces) return {};
    const glm::vec3 size = rays.boundsMax() - rays.boundsMin();
    return fmt::format(
        "{}: is {:.0f} x {:.0f} x {:.0f} m large and has {:.1f} million texels on {} faces: is it in metres, as glTF "
        "has it? If so, give its largest nodes fewer texels ('dimmer_texel_density')",
        rays.scene().file, size.x, size.y, size.z, texels * 1e-6, unwrap.faces.size());
}

std::vector<std::string> otherQualities(const Profile& profile, const std::string& quality) {
    std::vector<std::string> warnings;
    for (const auto& [key, origin] : profile.origin)
        if (origin == "command line" && key.starts_with("bake.") && !key.starts_with("bake." + quality + "."))
            warnings.push_back(fmt::format("--set {}: does nothing at quality '{}'", key, quality));
    return warnings;
}

}  // namespace dimmer::cook
