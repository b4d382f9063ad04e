#include <pipeline/cook.h>

#include <pipeline/cook_warnings.h>

#include <bake/bake.h>
#include <bake/buried_lights.h>
#include <bake/overlap.h>
#include <bake/sampling.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <charts/wall_cuts.h>
#include <cluster/cluster.h>
#include <encode/encode.h>
#include <models/scene_models.h>
#include <models/self_visibility.h>
#include <pipeline/budget.h>
#include <pipeline/level_meshes.h>
#include <pipeline/model_meshes.h>
#include <pipeline/prepare_scene.h>
#include <pipeline/set_scales.h>
#include <pipeline/settings.h>
#include <trace/ray_scene.h>
#include <update/state_text.h>
#include <write/pack_writer.h>

#include <fmt/format.h>
#include <pack/pack_reader.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <sstream>

namespace dimmer::cook {
namespace {

// The cheapest ways out of a budget that a message names.
constexpr size_t remedies_named = 3;

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
            fmt::format("{}: '{}' and '{}' depend on each other: up to {:.0f} % of the light that the lesser of them "
                        "moves is off while both are open; name [\"{}\", \"{}\"] in the scene's 'dimmer_combinations' "
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

UnwrapOptions unwrapOptions(const Profile& profile) {
    return {profile.texels_per_metre, profile.page_size};
}

// The level with its charts and receivers.
struct Charted {
    std::optional<RayScene> rays;
    Unwrap charts;
    Texels texels;
    Key key;
};

Expected<void> makeCharts(Scene& scene, const Profile& profile, const Quality& quality, Progress& progress,
                          Charted& out) {
    cutAtWalls(scene, profile.texels_per_metre);
    out.rays.emplace(scene);
    progress.advance(1);
    auto unwrapped = unwrap(*out.rays, unwrapOptions(profile));
    if (!unwrapped) return std::unexpected(unwrapped.error());
    out.charts = std::move(*unwrapped);
    out.texels = sampleTexels(*out.rays, out.charts, quality.samples_per_texel);
    return {};
}

// Warnings name the level's file, which is no part of the key.
void stripFile(std::vector<std::string>& warnings, const std::string& file) {
    for (std::string& w : warnings)
        if (w.starts_with(file)) w.erase(0, file.size());
}

// `scene` gets the open leaves of its doors, and faces that walls cut.
Expected<void> chart(Scene& scene, const Profile& profile, const Quality& quality, Progress& progress, CookCache* cache,
                     Charted& out) {
    progress.stage("charts", 2);
    prepareScene(scene, profile);
    if (cache) {
        const Key geometry = geometryKey(scene);
        out.key = chartsKey(geometry, unwrapOptions(profile), quality.samples_per_texel);
        cache->dependsOn("geometry", geometry);
        cache->dependsOn("settings of charts", chartsKey({}, unwrapOptions(profile), quality.samples_per_texel));
        if (auto found = cache->findCharts(out.key); found && found->meshes.size() == scene.meshes.size()) {
            for (size_t m = 0; m < scene.meshes.size(); ++m) takeGeometry(scene.meshes[m], std::move(found->meshes[m]));
            out.charts = std::move(found->charts);
            for (std::string& w : out.charts.warnings) w = scene.file + w;
            out.texels = std::move(found->texels);
            out.rays.emplace(scene);
            return {};
        }
    }
    if (auto ok = makeCharts(scene, profile, quality, progress, out); !ok) return ok;
    if (cache) {
        ChartsEntry entry{scene.meshes, out.charts, out.texels};
        stripFile(entry.charts.warnings, scene.file);
        cache->keepCharts(out.key, entry);
    }
    return {};
}

// The scene's light sets are divided by their scales.
Baked bakeWithCache(const Charted& level, BakeSettings settings, const SetScales& scales, Progress& progress,
                    CookCache* cache) {
    for (const glm::vec3 scale : scales.of_group) settings.group_brightness.push_back(luminance(scale));
    if (!cache) return bake(*level.rays, level.charts, level.texels, settings, progress);
    const Scene& scene = level.rays->scene();
    const Key settings_key = bakeSettingsKey(settings);
    cache->dependsOn("settings of the bake", settings_key);
    std::vector<Key> keys;
    for (uint32_t g = 0; g <= scene.light_sets.size(); ++g) {
        const Key lamps = lampsKey(scene, g);
        cache->dependsOn("lamps of " + describeGroup(scene, g), lamps);
        keys.push_back(groupKey(level.key, settings_key, settings.thresholdOf(g), lamps));
        cache->dependsOn("threshold of " + describeGroup(scene, g),
                         KeyBuilder("").add(settings.thresholdOf(g)).finish());
    }
    const Key grid_settings = gridSettingsKey(settings.grid, scene);
    cache->dependsOn("settings of the grid", grid_settings);
    const Key grid = gridKey(grid_settings, keys);
    CachedGroups groups(*cache, scene, std::move(keys), grid, sceneRaysKey(level.key, settings_key, scene));
    return bake(*level.rays, level.charts, level.texels, settings, progress, &groups);
}

}  // namespace

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
                          .bounces_max = quality.bounces,
                          .tail_max = quality.tolerance,
                          .threshold = profile.threshold,
                          .door_share = profile.door_share,
                          .light_grid = quality.light_grid,
                          .per_set_passes = quality.per_set_passes,
                          .grid = {.probes_max = wantsGrid(profile, scene) ? profile.probes_max : 0,
                                   .min_spacing_m = profile.global_min_spacing_m,
                                   .sites = quality.probe_sites,
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

Expected<PackData> cookScene(Scene scene, const Profile& profile, const std::string& quality_name, Progress& progress,
                             CookStats& stats, CookCache* cache, LossTable* losses) {
    const Quality* quality = profile.quality(quality_name);
    if (!quality)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("there is no quality '{}'; take draft, preview or final", quality_name));
    PackData pack;
    Charted level;
    const SetScales scales = divideByScales(scene);
    {
        Stopwatch watch(stats, "charts");
        if (auto ok = chart(scene, profile, *quality, progress, cache, level); !ok) return std::unexpected(ok.error());
        findTransfers(scene);
        const auto buried = warningsOfBuriedLights(*level.rays);
        stats.warnings.insert(stats.warnings.end(), buried.begin(), buried.end());
        if (auto warning = farFromOrigin(*level.rays)) stats.warnings.push_back(std::move(*warning));
        progress.advance(1);
    }
    const Unwrap& charts = level.charts;
    const Texels& texels = level.texels;
    const RayScene& rays = *level.rays;
    stats.warnings.insert(stats.warnings.end(), charts.warnings.begin(), charts.warnings.end());
    if (texels.size() == 0)
        return fail(ErrorCode::BadInput, scene.file +
                                             ": every surface lies inside closed geometry, facing inwards; "
                                             "check the winding of the level's triangles");
    Baked baked;
    {
        Stopwatch watch(stats, "bake");
        const BakeSettings settings = bakeSettings(profile, *quality, scene);
        StageTimer timer(progress, stats.bake_seconds);
        baked = bakeWithCache(level, settings, scales, timer, cache);
        multiplyByScales(scales, baked);
        limitOverlap(baked, texels.area_m2, profile.overlap_max);
        if (losses)
            *losses = LossTable(baked, texels, settings.group_thresholds, chartSizes(rays, charts, profile.page_size));
    }
    stats.rays += baked.rays;
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
        if (auto warning = coarseExposure(scene, pack.exposure)) stats.warnings.push_back(std::move(*warning));
        buildClusters(texels, baked, contribution_of_term, pack);
        buildProbeClusters(baked, contribution_of_term, pack);
        pack.probes.local = localGrids(scene, static_cast<uint32_t>(pack.probes.global.positions.size()));
        stats.free_volume_m3 = baked.grid.free_volume_m3;
        pack.meshes = levelMeshes(rays, charts, scales.emission_cd_m2);
        describeModels(scene, scales.emission_cd_m2, pack);
        describePlaces(scene, pack);
        pack.settings_json = profile.settingsJson(quality_name);
        progress.advance(1);
    }
    progress.finish();
    return pack;
}

namespace {

// Null where the options ask for none, or where only a run without one measures what it is to measure.
std::optional<CookCache> openCache(const CookOptions& options, CookStats& stats) {
    if (options.cache.empty() || options.per_set_passes || !options.grid_baseline.empty()) return {};
    auto store = CacheStore::open(options.cache);
    if (store) return CookCache(std::move(*store), options.pack);
    stats.warnings.push_back("cooked without a cache: " + store.error().message);
    return {};
}

Key packKey(const Scene& scene, const Profile& profile, const std::string& quality, CookCache& cache) {
    const Key level = sceneKey(scene);
    const Quality* q = profile.quality(quality);
    const Key settings = KeyBuilder("settings")
                             .add(profile.settingsJson(quality))
                             .add(bakeSettingsKey(bakeSettings(profile, q ? *q : Quality{}, scene)))
                             .finish();
    cache.dependsOn("level", level);
    cache.dependsOn("settings", settings);
    return KeyBuilder("pack").add(level).add(settings).finish();
}

// The pack of an earlier cook of the same.
Expected<std::vector<std::byte>> takePack(PackEntry entry, CookResult& result) {
    auto pack = readPack(entry.pack);
    if (!pack) return std::unexpected(pack.error());
    result.pack = std::move(*pack);
    result.stats.warnings = std::move(entry.warnings);
    result.stats.bounces = entry.bounces;
    result.stats.suggested_combinations = std::move(entry.suggested_combinations);
    return std::move(entry.pack);
}

// Each round of `--fit` cooks anew: more than a few mean that something does not follow its prediction.
constexpr int fit_rounds_max = 6;

// Those that are enough come first, so that a first one that is not tells of all.
std::string waysOut(const std::vector<Remedy>& found) {
    if (found.empty()) return "; no setting would mend it";
    std::string text = found[0].fits ? "; what would help:" : "; nothing is enough by itself; what would help:";
    for (const Remedy& remedy : std::span(found).first(std::min<size_t>(found.size(), remedies_named)))
        text += "\n  " + remedy.text() + (found[0].fits && !remedy.fits ? " (not enough by itself)" : "");
    return text;
}

// The figures of an error are those of the last cook, not of the settings that were asked for.
std::string changedBefore(const std::vector<Remedy>& fitted) {
    std::string text = fitted.empty() ? "" : "\n--fit had changed before this cook:";
    for (const Remedy& remedy : fitted) text += "\n  " + remedy.text();
    return text;
}

// Cooks, and with `fit` changes result.profile and cooks again until the pack is within its budgets.
Expected<PackData> cookWithin(const Scene& scene, const std::string& quality, bool fit, Progress& progress,
                              CookCache* cache, CookResult& result) {
    const std::vector<std::string> import_warnings = result.stats.warnings;
    for (int round = 0;; ++round) {
        result.stats.warnings = import_warnings;
        result.stats.suggested_combinations.clear();
        LossTable losses;
        auto pack = cookScene(scene, result.profile, quality, progress, result.stats, cache, &losses);
        if (!pack) return pack;
        const PackCost cost = costOf(*pack);
        const auto within = checkBudgets(*pack, cost, result.profile);
        if (within) return pack;
        if (!fit || round + 1 == fit_rounds_max) {
            return fail(ErrorCode::OverBudget, within.error().message +
                                                   waysOut(remedies(*pack, cost, result.profile, losses)) +
                                                   changedBefore(result.fitted));
        }
        const auto density_steps =
            std::ranges::count_if(result.fitted, [](const Remedy& r) { return r.changes.front().key == density_key; });
        Remedy remedy = fittingRemedy(*pack, cost, result.profile, losses, static_cast<size_t>(density_steps));
        if (remedy.changes.empty()) {
            const auto found = remedies(*pack, cost, result.profile, losses);
            const char* why = found.empty() ? "; nothing that --fit changes would help"
                                            : "; all that --fit changes would not be enough";
            return fail(ErrorCode::OverBudget,
                        within.error().message + why + waysOut(found) + changedBefore(result.fitted));
        }
        for (const Change& c : remedy.changes)
            if (auto ok = assignText(result.profile, fmt::format("{}={}", c.key, c.to), "--fit", "fit"); !ok)
                return std::unexpected(ok.error());
        result.fitted.push_back(std::move(remedy));
    }
}

Expected<std::vector<std::byte>> makePack(const Scene& scene, const CookOptions& options, Progress& progress,
                                          CookCache* cache, CookResult& result) {
    auto pack = cookWithin(scene, options.quality, options.fit, progress, cache, result);
    if (!pack) return std::unexpected(pack.error());
    result.pack = std::move(*pack);
    Stopwatch watch(result.stats, "write");
    return packBytes(result.pack, static_cast<int>(result.profile.quality(options.quality)->zstd_level));
}

// From the cache or anew. Fitted packs are made anew from what the cache has of their parts.
Expected<std::vector<std::byte>> findOrMakePack(const Scene& scene, const CookOptions& options, Progress& progress,
                                                CookCache* cache, CookResult& result) {
    if (!cache || options.fit) return makePack(scene, options, progress, cache, result);
    const Key key = packKey(scene, result.profile, options.quality, *cache);
    if (auto entry = cache->findPack(key)) return takePack(std::move(*entry), result);
    auto bytes = makePack(scene, options, progress, cache, result);
    if (bytes)
        cache->keepPack(key,
                        {*bytes, result.stats.bounces, result.stats.warnings, result.stats.suggested_combinations, {}});
    return bytes;
}

}  // namespace

namespace {

Expected<void> cookInto(CookResult& result, const CookOptions& options, Progress& progress) {
    std::optional<tbb::global_control> limit;
    if (options.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
    auto profile = loadProfile(options.profile);
    if (!profile) return std::unexpected(profile.error());
    for (Quality* quality : {&profile->draft, &profile->preview, &profile->final}) {
        quality->per_set_passes = options.per_set_passes;
        quality->light_grid = options.light_grid;
        quality->grid_baseline = options.grid_baseline;
    }
    Expected<Scene> scene;
    {
        Stopwatch watch(result.stats, "import");
        scene = importLevel(options.level);
    }
    if (!scene) return std::unexpected(scene.error());
    result.stats.warnings = scene->warnings;
    if (options.quality_is_chosen) profile->origin["quality"] = "command line";
    auto idle = resolveSettings(*profile, *scene, options.set);
    if (!idle) return std::unexpected(idle.error());
    for (std::string& warning : otherQualities(*profile, options.quality)) idle->push_back(std::move(warning));
    // The scene's, too: a pack in the cache is that of the same warnings.
    for (auto* warnings : {&result.stats.warnings, &scene->warnings})
        warnings->insert(warnings->end(), idle->begin(), idle->end());
    result.profile = *profile;
    auto cache = openCache(options, result.stats);
    const auto bytes = findOrMakePack(*scene, options, progress, cache ? &*cache : nullptr, result);
    if (cache) {
        cache->finish(options.cache_bytes_max);
        result.stats.cache = cache->lines();
        for (const std::string& w : cache->warnings()) result.stats.warnings.push_back(w);
    }
    if (!bytes) return std::unexpected(bytes.error());
    {
        Stopwatch watch(result.stats, "write");
        result.file_bytes = bytes->size();
        if (auto ok = writeFileAtomically(options.pack, *bytes); !ok) return std::unexpected(ok.error());
    }
    result.stats.peak_bytes = peakBytes();
    return {};
}

}  // namespace

Expected<CookResult> cook(const CookOptions& options, Progress& progress, std::vector<std::string>* warnings) {
    CookResult result;
    auto ok = cookInto(result, options, progress);
    if (ok) return result;
    if (warnings) *warnings = std::move(result.stats.warnings);
    return std::unexpected(ok.error());
}

}  // namespace dimmer::cook
