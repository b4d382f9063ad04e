#include <pipeline/encode_pack.h>

#include <cluster/cluster.h>
#include <encode/encode.h>
#include <models/scene_models.h>
#include <pipeline/cook_warnings.h>
#include <pipeline/door_warnings.h>
#include <pipeline/level_meshes.h>
#include <pipeline/model_meshes.h>

#include <fmt/format.h>

#include <cmath>

namespace dimmer::cook {
namespace {

void describeElements(const Scene& scene, PackData& pack) {
    for (const SceneLightSet& set : scene.light_sets)
        pack.elements.push_back({set.name, ElementKind::LightSet, set.max_weight});
    for (const SceneDoor& door : scene.doors) pack.elements.push_back({door.name, ElementKind::Door, 1});
}

// One contribution per light set, and one per term with doors that some receiver has. Returns them by term.
std::vector<uint32_t> describeContributions(const Scene& scene, const Baked& baked, PackData& pack) {
    const auto first_door = static_cast<uint32_t>(scene.light_sets.size());
    const auto elements = [&](std::vector<uint32_t> doors) {
        for (uint32_t& door : doors) door += first_door;
        return doors;
    };
    std::vector<uint32_t> contribution_of_term(baked.terms.size(), no_index);
    for (uint32_t t = always_group + 1; t < baked.terms.size(); ++t) {
        const Term& term = baked.terms[t];
        if (!term.free() && baked.reports[t].receivers == 0) continue;
        contribution_of_term[t] = static_cast<uint32_t>(pack.contributions.size());
        pack.contributions.push_back({.light_set = {},
                                      .doors_open = elements(term.doors_open),
                                      .doors_closed = elements(term.doors_closed),
                                      .receivers = 0,
                                      .energy_dropped = static_cast<float>(baked.reports[t].energy_dropped)});
        if (term.group != always_group) pack.contributions.back().light_set = term.group - 1;
    }
    return contribution_of_term;
}

void describePlaces(const Scene& scene, PackData& pack) {
    for (const SceneViewpoint& v : scene.viewpoints)
        pack.viewpoints.push_back({v.name,
                                   {v.position_m.x, v.position_m.y, v.position_m.z},
                                   {v.forward.x, v.forward.y, v.forward.z},
                                   v.vertical_fov_rad});
}

}  // namespace

PackData encodePack(const ChartedLevel& level, const Texels& texels, const Baked& baked, const Profile& profile,
                    const std::string& quality, CookStats& stats) {
    const Scene& scene = level.scene;
    PackData pack;
    pack.page_width = level.charts.page_width;
    pack.page_height = level.charts.page_height;
    pack.page_count = level.charts.page_count;
    describeElements(scene, pack);
    const std::vector<uint32_t> contribution_of_term = describeContributions(scene, baked, pack);
    warnOfElements(scene, baked, stats);
    std::vector<float> max_weights;
    for (const Term& term : baked.terms)
        max_weights.push_back(term.group == always_group ? 1 : scene.light_sets[term.group - 1].max_weight);
    pack.color_format = profile.color_format;
    pack.direction_model = profile.direction_model;
    pack.exposure = chooseExposure(baked, max_weights);
    if (auto warning = coarseExposure(scene, pack.exposure, baked.terms[brightestTerm(baked, max_weights)].group))
        stats.warnings.push_back(std::move(*warning));
    buildClusters(texels, baked, contribution_of_term, profile.overlap_max, pack);
    buildProbeClusters(baked, contribution_of_term, profile.overlap_max, pack);
    pack.probes.local = localGrids(scene, static_cast<uint32_t>(pack.probes.global.positions.size()));
    stats.free_volume_m3 = baked.grid.free_volume_m3;
    pack.meshes = levelMeshes(*level.rays, level.charts, level.scales.emission_cd_m2);
    describeModels(scene, level.scales.emission_cd_m2, pack);
    describePlaces(scene, pack);
    pack.settings_json = profile.settingsJson(quality);
    return pack;
}

}  // namespace dimmer::cook
