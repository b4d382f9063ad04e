// cookScene: from a scene in memory to a pack in memory.
#include <pipeline/cook.h>

#include <bake/buried_lights.h>
#include <bake/door_pairs.h>
#include <bake/door_paths.h>
#include <bake/overlap.h>
#include <bake/sampling.h>
#include <charts/texels.h>
#include <models/self_visibility.h>
#include <pipeline/budget.h>
#include <pipeline/charted_level.h>
#include <pipeline/cook_settings.h>
#include <pipeline/cook_warnings.h>
#include <pipeline/encode_pack.h>
#include <pipeline/free_memory.h>
#include <pipeline/lamps_apart.h>
#include <probes/air_box.h>

#include <fmt/format.h>

namespace dimmer::cook {
namespace {

// The level with its charts and receivers.
struct Receivers {
    Receivers(Scene scene, const Profile& profile) : level(std::move(scene), profile) {}
    ChartedLevel level;
    Texels texels;
    Key key;
};

// From the cache or anew.
Expected<void> findReceivers(const Profile& profile, const Quality& quality, CookCache* cache, Progress& progress,
                             Receivers& out) {
    ChartedLevel& level = out.level;
    if (cache) {
        const Key geometry = geometryKey(level.scene);
        out.key = chartsKey(geometry, unwrapOptions(profile), quality.samples_per_texel);
        cache->dependsOn("geometry", geometry);
        cache->dependsOn("settings of charts", chartsKey({}, unwrapOptions(profile), quality.samples_per_texel));
        std::vector<SceneMesh>& meshes = level.scene.meshes;
        if (auto found = cache->findCharts(out.key); found && found->meshes.size() == meshes.size()) {
            for (size_t m = 0; m < meshes.size(); ++m) takeGeometry(meshes[m], std::move(found->meshes[m]));
            level.charts = std::move(found->charts);
            out.texels = std::move(found->texels);
            level.rays.emplace(level.scene);
            return {};
        }
    }
    if (auto ok = level.chart(profile); !ok) return ok;
    // A level in centimetres has ten thousand times as many: that takes minutes, after which nobody reads.
    if (const auto warning = tooLargeForTexels(*level.rays, level.charts)) progress.warn(*warning);
    out.texels = sampleTexels(*level.rays, level.charts, quality.samples_per_texel, &progress);
    if (cache) cache->keepCharts(out.key, {level.scene.meshes, level.charts, out.texels});
    return {};
}

// Of where things are. Entries of a cache name no nodes: this is said in every cook.
void warnOfPlaces(const Receivers& at, CookStats& stats) {
    const ChartedLevel& level = at.level;
    const auto buried = warningsOfBuriedLights(*level.rays);
    stats.warnings.insert(stats.warnings.end(), buried.begin(), buried.end());
    if (auto warning = farFromOrigin(*level.rays)) stats.warnings.push_back(std::move(*warning));
    if (auto warning = withoutLight(level.scene)) stats.warnings.push_back(std::move(*warning));
    if (auto warning = tooSmallForTexels(*level.rays, level.charts, at.texels))
        stats.warnings.push_back(std::move(*warning));
    if (auto warning = tooLargeForTexels(*level.rays, level.charts)) stats.warnings.push_back(std::move(*warning));
    for (const ChartWarning& w : level.charts.warnings)
        stats.warnings.push_back(
            fmt::format("{}: node '{}': {}", level.scene.file, level.scene.meshes[w.mesh].node, w.text));
}

Expected<void> checkTerms(const ChartedLevel& level) {
    const Scene& scene = level.scene;
    const DoorPaths paths(scene, doorsInSight(*level.rays));
    const size_t terms = paths.termCount();
    if (terms + pairTerms(paths.groupCount()) <= terms_max) return {};  // a bake measures pairs besides
    return fail(ErrorCode::BadInput,
                fmt::format("{}: its {} doors, those that see each other and what combinations name, make {} "
                            "contributions with its {} light sets; {} are the most. Name fewer doors in one "
                            "combination, or a light set with them: each door more makes it three times as many, of "
                            "every light set where it names none.",
                            scene.file, scene.doors.size(), terms, scene.light_sets.size(), terms_max));
}

Baked bakeWithCache(const Receivers& at, BakeSettings settings, Progress& progress, CookCache* cache) {
    const ChartedLevel& level = at.level;
    for (const glm::vec3 scale : level.scales.of_group) settings.group_brightness.push_back(luminance(scale));
    if (!cache) return bake(*level.rays, level.charts, at.texels, settings, progress);
    const Scene& scene = level.scene;
    const Key settings_key = bakeSettingsKey(settings);
    cache->dependsOn("settings of the bake", settings_key);
    std::vector<Key> keys;
    for (uint32_t g = 0; g <= scene.light_sets.size(); ++g) {
        const Key lamps = lampsKey(scene, g);
        cache->dependsOn("lamps of " + describeGroup(scene, g), lamps);
        keys.push_back(groupKey(at.key, settings_key, settings.thresholdOf(g), lamps));
        cache->dependsOn("threshold of " + describeGroup(scene, g),
                         KeyBuilder("").add(settings.thresholdOf(g)).finish());
    }
    const Box air = settings.grid.probes_max > 0 ? airBox(*level.rays) : Box{};
    const Key grid_settings = gridSettingsKey(settings.grid, scene, air);
    cache->dependsOn("settings of the grid", grid_settings);
    const Key lamp_order = lampOrderKey(scene);
    cache->dependsOn(lamp_order_part, lamp_order);
    const Key grid = gridKey(grid_settings, lamp_order, keys);
    CachedGroups groups(*cache, scene, std::move(keys), grid, sceneRaysKey(at.key, settings_key, scene));
    return bake(*level.rays, level.charts, at.texels, settings, progress, &groups);
}

}  // namespace

Expected<PackData> cookScene(Scene scene, const Profile& profile, const std::string& quality_name, Progress& progress,
                             CookStats& stats, CookCache* cache, LossTable* losses) {
    const Quality* quality = profile.quality(quality_name);
    if (!quality)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("there is no quality '{}'; take draft, preview or final", quality_name));
    const BakeSettings settings = bakeSettings(profile, *quality, scene);
    const LampGroups lamps = takeLampsApart(scene, quality->lamps_apart);
    Receivers at(std::move(scene), profile);
    ChartedLevel& level = at.level;
    {
        const Stopwatch watch(stats.seconds["charts"]);
        progress.stage("charts", 1);
        if (auto ok = findReceivers(profile, *quality, cache, progress, at); !ok) return std::unexpected(ok.error());
        progress.advance(1);
        const size_t known = stats.warnings.size();
        warnOfPlaces(at, stats);
        for (const std::string& warning : std::span(stats.warnings).subspan(known)) progress.warn(warning);
    }
    if (std::ranges::any_of(level.scene.models, [](const SceneModel& model) { return !model.meshes.empty(); })) {
        const Stopwatch watch(stats.seconds["models"]);
        findTransfers(level.scene, progress);
    }
    if (at.texels.size() == 0)
        return fail(ErrorCode::BadInput, level.scene.file +
                                             ": every surface lies inside closed geometry, facing inwards; "
                                             "check the winding of the level's triangles");
    if (auto ok = checkTerms(level); !ok) return std::unexpected(ok.error());
    Baked baked;
    // Where receivers are limited this is known before the limit alone: what that drops comes back where higher
    // thresholds make room.
    const auto findLosses = [&] {
        return LossTable(baked, at.texels, settings.group_thresholds, profile.overlap_max,
                         chartSizes(*level.rays, level.charts, profile.page_size));
    };
    {
        const Stopwatch watch(stats.seconds["bake"]);
        BakeSettings of_parts = settings;
        of_parts.group_thresholds = lamps.ofParts(settings.group_thresholds);
        StageTimer timer(progress, stats.bake_seconds);
        baked = bakeWithCache(at, of_parts, timer, cache);
        multiplyByScales(level.scales, baked);
        putTogether(lamps, level.scales, level.scene, baked);
        if (losses && profile.overlap_max > 0) *losses = findLosses();
        limitOverlap(baked, at.texels.area_m2, profile.overlap_max);
    }
    stats.rays += baked.rays;
    stats.bounces = baked.bounces;
    double energy_lm = 0;
    for (const TermReport& r : baked.reports) energy_lm += r.energy;
    if (auto warning = allInTheDark(*level.rays, level.charts, at.texels, energy_lm))
        stats.warnings.push_back(std::move(*warning));
    for (const std::string& w : baked.warnings) stats.warnings.push_back(level.scene.file + ": " + w);
    PackData pack;
    {
        const Stopwatch watch(stats.seconds["encode"]);
        giveBackMuchFreeMemory();
        progress.stage("encode", 1);
        pack = encodePack(level, at.texels, baked, profile, quality_name, stats);
        progress.advance(1);
    }
    if (losses && profile.overlap_max == 0 && !checkBudgets(pack, costOf(pack), profile)) *losses = findLosses();
    progress.finish();
    return pack;
}

}  // namespace dimmer::cook
