#include <pipeline/cook.h>

#include <bake/bake.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <charts/wall_cuts.h>
#include <cluster/cluster.h>
#include <encode/encode.h>
#include <pipeline/budget.h>
#include <pipeline/level_meshes.h>
#include <scene/open_pose.h>
#include <trace/ray_scene.h>
#include <write/pack_writer.h>

#include <fmt/format.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <chrono>

namespace dimmer::cook {
namespace {

class Stopwatch {
   public:
    Stopwatch(CookStats& stats, std::string stage) : stats_(stats), stage_(std::move(stage)) {}
    ~Stopwatch() {
        stats_.seconds[stage_] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

   private:
    CookStats& stats_;
    std::string stage_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

uint64_t peakBytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

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

void warnOfIdleElements(const Scene& scene, const Baked& baked, CookStats& stats) {
    std::vector<bool> used(scene.doors.size());
    for (uint32_t t = 0; t < baked.terms.size(); ++t) {
        const Term& term = baked.terms[t];
        if (baked.reports[t].receivers > 0)
            for (const auto* doors : {&term.doors_open, &term.doors_closed})
                for (const uint32_t door : *doors) used[door] = true;
        else if (term.free() && term.group != always_group)
            stats.warnings.push_back(fmt::format("{}: light set '{}' reaches no surface; it is kept, and does nothing",
                                                 scene.file, scene.light_sets[term.group - 1].name));
    }
    for (uint32_t d = 0; d < used.size(); ++d)
        if (!used[d])
            stats.warnings.push_back(fmt::format("{}: door '{}' changes no light; it is kept, and does nothing",
                                                 scene.file, scene.doors[d].name));
}

void warnOfDependentDoors(const Scene& scene, const Baked& baked, CookStats& stats) {
    for (const DoorPair& pair : baked.dependent_doors) {
        const std::string first = "door:" + scene.doors[pair.first].name,
                          second = "door:" + scene.doors[pair.second].name;
        stats.suggested_combinations.emplace_back(first, second);
        stats.warnings.push_back(
            fmt::format("{}: '{}' and '{}' depend on each other: {:.0f} % of the light that the lesser of them moves "
                        "needs both, and is left out; name [\"{}\", \"{}\"] in the scene's 'dimmer_combinations' "
                        "(--suggest-combinations prints the list)",
                        scene.file, first, second, 100 * static_cast<double>(pair.loss), first, second));
    }
}

void describePlaces(const Scene& scene, PackData& pack) {
    for (const SceneViewpoint& v : scene.viewpoints)
        pack.viewpoints.push_back({v.name,
                                   {v.position_m.x, v.position_m.y, v.position_m.z},
                                   {v.forward.x, v.forward.y, v.forward.z},
                                   v.vertical_fov_rad});
}

}  // namespace

BakeSettings bakeSettings(const Profile& profile, const Quality& quality) {
    return {.series_rays = quality.series_rays,
            .final_rays = quality.rays,
            .emitter_samples = quality.emitter_samples,
            .noise_max = quality.noise,
            .denoise = quality.denoise != 0,
            .bounces_max = quality.bounces,
            .tail_max = quality.tolerance,
            .threshold = profile.threshold,
            .light_grid = quality.light_grid,
            .per_set_passes = quality.per_set_passes,
            .grid = {.probes_max = profile.probes_max,
                     .min_spacing_m = profile.global_min_spacing_m,
                     .sites = quality.probe_sites,
                     .uniform = quality.grid_baseline == "uniform",
                     .fit = quality.grid_baseline != "unfitted",
                     .visibility = quality.grid_baseline != "unseen"}};
}

Expected<PackData> cookScene(Scene scene, const Profile& profile, const std::string& quality_name, Progress& progress,
                             CookStats& stats) {
    const Quality* quality = profile.quality(quality_name);
    if (!quality)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("there is no quality '{}'; take draft, preview or final", quality_name));
    PackData pack;
    progress.stage("charts", 2);
    std::optional<RayScene> rays;
    Unwrap charts;
    Texels texels;
    {
        Stopwatch watch(stats, "charts");
        addOpenLeaves(scene);
        cutAtWalls(scene, profile.texels_per_metre);
        rays.emplace(scene);
        progress.advance(1);
        auto unwrapped = unwrap(*rays, {profile.texels_per_metre, profile.page_size});
        if (!unwrapped) return std::unexpected(unwrapped.error());
        charts = std::move(*unwrapped);
        texels = sampleTexels(*rays, charts, quality->samples_per_texel);
        progress.advance(1);
    }
    stats.warnings.insert(stats.warnings.end(), charts.warnings.begin(), charts.warnings.end());
    if (texels.size() == 0)
        return fail(ErrorCode::BadInput, scene.file +
                                             ": every surface lies inside closed geometry, facing inwards; "
                                             "check the winding of the level's triangles");
    Baked baked;
    {
        Stopwatch watch(stats, "bake");
        const BakeSettings settings = bakeSettings(profile, *quality);
        baked = bake(*rays, charts, texels, settings, progress);
    }
    stats.rays = baked.rays;
    stats.bounces = baked.bounces;
    for (const std::string& w : baked.warnings) stats.warnings.push_back(scene.file + ": " + w);
    {
        Stopwatch watch(stats, "encode");
        progress.stage("encode", 1);
        pack.page_width = charts.page_width;
        pack.page_height = charts.page_height;
        pack.page_count = charts.page_count;
        describeElements(scene, pack);
        const std::vector<uint32_t> contribution_of_term = describeContributions(scene, baked, pack);
        warnOfIdleElements(scene, baked, stats);
        warnOfDependentDoors(scene, baked, stats);
        std::vector<float> max_weights;
        for (const Term& term : baked.terms)
            max_weights.push_back(term.group == always_group ? 1 : scene.light_sets[term.group - 1].max_weight);
        pack.color_format = profile.color_format;
        pack.direction_model = profile.direction_model;
        pack.exposure = chooseExposure(baked, max_weights);
        buildClusters(texels, baked, contribution_of_term, pack);
        buildProbeClusters(baked.grid, contribution_of_term, pack);
        stats.free_volume_m3 = baked.grid.free_volume_m3;
        pack.meshes = levelMeshes(*rays, charts);
        describePlaces(scene, pack);
        pack.settings_json = profile.settingsJson(quality_name);
        progress.advance(1);
    }
    progress.finish();
    return pack;
}

Expected<CookResult> cook(const CookOptions& options, Progress& progress) {
    std::optional<tbb::global_control> limit;
    if (options.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
    auto profile = loadProfile(options.profile);
    if (!profile) return std::unexpected(profile.error());
    for (Quality* quality : {&profile->draft, &profile->preview, &profile->final}) {
        quality->per_set_passes = options.per_set_passes;
        quality->light_grid = options.light_grid;
        quality->grid_baseline = options.grid_baseline;
    }
    CookResult result;
    Expected<Scene> scene;
    {
        Stopwatch watch(result.stats, "import");
        scene = importLevel(options.level);
    }
    if (!scene) return std::unexpected(scene.error());
    result.stats.warnings = scene->warnings;
    auto pack = cookScene(*scene, *profile, options.quality, progress, result.stats);
    if (!pack) return std::unexpected(pack.error());
    result.pack = std::move(*pack);
    if (auto ok = checkBudgets(result.pack, costOf(result.pack), *profile); !ok) return std::unexpected(ok.error());
    {
        Stopwatch watch(result.stats, "write");
        const auto bytes = packBytes(result.pack);
        result.file_bytes = bytes.size();
        if (auto ok = writeFileAtomically(options.pack, bytes); !ok) return std::unexpected(ok.error());
    }
    result.stats.peak_bytes = peakBytes();
    return result;
}

}  // namespace dimmer::cook
