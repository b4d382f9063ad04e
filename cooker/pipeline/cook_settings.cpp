#include <pipeline/cook_settings.h>

#include <pipeline/settings.h>
#include <update/state_text.h>

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace dimmer::cook {

bool wantsGrid(const Profile& profile, const Scene& scene) {
    if (profile.global_grid != GridMode::Auto) return profile.global_grid == GridMode::On;
    return !scene.dynamic_places.empty() || !scene.play_areas.empty() ||
           std::ranges::any_of(scene.meshes, [](const SceneMesh& mesh) { return mesh.lighting == Lighting::Dynamic; });
}

BakeSettings bakeSettings(const Profile& profile, const Quality& quality, const Scene& scene) {
    BakeSettings settings{.series_rays = quality.series_rays,
                          .final_rays = quality.rays,
                          .emitter_samples = quality.emitter_samples,
                          .noise_max = quality.noise,
                          .denoise = quality.denoise != 0,
                          .sharpen = quality.sharpen != 0,
                          .bounces_max = quality.bounces,
                          .tail_max = quality.tolerance,
                          .threshold = profile.threshold,
                          .door_share = profile.door_share,
                          .light_grid = quality.light_grid,
                          .per_set_passes = quality.per_set_passes,
                          .grid = {.probes_max = wantsGrid(profile, scene) ? profile.probes_max : 0,
                                   .probes_per_m3 = profile.probes_per_m3,
                                   .min_spacing_m = profile.global_min_spacing_m,
                                   .sites = quality.probe_sites,
                                   .site_rays = quality.probe_rays,
                                   .uniform = quality.grid_baseline == "uniform",
                                   .fit = quality.grid_baseline != "unfitted",
                                   .visibility = quality.grid_baseline != "unseen"}};
    settings.group_thresholds.assign(1 + scene.light_sets.size(), profile.threshold);
    for (uint32_t s = 0; s < scene.light_sets.size(); ++s)
        if (const auto own = profile.set_thresholds.find(scene.light_sets[s].name); own != profile.set_thresholds.end())
            settings.group_thresholds[1 + s] = own->second;
    return settings;
}

Expected<std::vector<std::string>> resolveSettings(Profile& profile, const Scene& scene,
                                                   const std::vector<std::string>& set) {
    std::istringstream texts(scene.settings);
    for (std::string text; std::getline(texts, text, ',');) {
        text.erase(0, text.find_first_not_of(' '));
        text.erase(text.find_last_not_of(' ') + 1);
        if (text.empty()) continue;
        if (auto ok = assignText(profile, text, scene.file + ": scene: 'dimmer_settings'", "level"); !ok)
            return std::unexpected(ok.error());
    }
    for (const std::string& text : set)
        if (auto ok = assignText(profile, text, "--set", "command line"); !ok) return std::unexpected(ok.error());
    std::vector<std::string_view> names;
    for (const SceneLightSet& s : scene.light_sets) names.push_back(s.name);
    std::vector<std::string> warnings;
    for (auto own = profile.set_thresholds.begin(); own != profile.set_thresholds.end();) {
        const std::string& name = own->first;
        if (std::ranges::find(names, name) != names.end()) {
            ++own;
            continue;
        }
        const std::string key = std::string(set_threshold_prefix) + name, origin = profile.origin[key];
        const std::string_view nearest = nearestName(name, names);
        const std::string what = fmt::format("'{}' names no light set of this level{}", key,
                                             nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
        if (origin == "level" || origin == "command line")
            return fail(ErrorCode::BadInput, fmt::format("{}: {}", scene.file, what));
        warnings.push_back(fmt::format("{}: {}: {}", scene.file, origin, what));
        profile.origin.erase(key);
        own = profile.set_thresholds.erase(own);
    }
    return warnings;
}

}  // namespace dimmer::cook
