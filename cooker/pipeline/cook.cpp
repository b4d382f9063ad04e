// cook: a level's file in, a pack's file out.
#include <pipeline/cook.h>

#include <format/layout.h>
#include <pipeline/cook_settings.h>
#include <pipeline/cook_warnings.h>
#include <pipeline/cook_within.h>
#include <write/pack_writer.h>

#include <fmt/format.h>
#include <pack/pack_reader.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <cstring>

namespace dimmer::cook {
namespace {

uint64_t peakBytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

// Null where the options ask for none, or where only a run without one measures what it is to measure.
std::optional<CookCache> openCache(const CookOptions& options, CookStats& stats) {
    if (options.cache.empty() || options.per_set_passes || !options.grid_baseline.empty()) return {};
    auto store = CacheStore::open(options.cache);
    if (store) return CookCache(std::move(*store), options.pack);
    stats.warnings.push_back("cooked without a cache: " + store.error().message);
    return {};
}

Key packKey(const Scene& scene, const Profile& profile, const CookOptions& options, CookCache& cache) {
    const Key level = sceneKey(scene);
    const Quality* q = profile.quality(options.quality);
    const Key settings = KeyBuilder("settings")
                             .add(profile.settingsJson(options.quality))
                             .add(bakeSettingsKey(bakeSettings(profile, q ? *q : Quality{}, scene)))
                             .add(uint32_t{options.fit})
                             .addOptional(options.fit_error_max)
                             .finish();
    cache.dependsOn("level", level);
    cache.dependsOn("settings", settings);
    return KeyBuilder("pack").add(level).add(settings).finish();
}

// The pack of an earlier cook of the same.
Expected<std::vector<std::byte>> takePack(PackEntry entry, CookResult& result) {
    MemorySource source(entry.pack);
    auto pack = readPack(source);
    if (!pack) return std::unexpected(pack.error());
    result.pack = std::move(*pack);
    result.stats.warnings = std::move(entry.warnings);
    result.stats.bounces = entry.bounces;
    result.stats.suggested_combinations = std::move(entry.suggested_combinations);
    result.fitted = std::move(entry.fitted);
    for (const Remedy& remedy : result.fitted)
        if (auto ok = applyRemedy(remedy, result.profile); !ok) return std::unexpected(ok.error());
    return std::move(entry.pack);
}

Expected<std::vector<std::byte>> makePack(const Scene& scene, const CookOptions& options, Progress& progress,
                                          CookCache* cache, CookResult& result) {
    auto pack = cookWithin(scene, options, progress, cache, result);
    if (!pack) return std::unexpected(pack.error());
    result.pack = std::move(*pack);
    const Stopwatch watch(result.stats.seconds["write"]);
    return packBytes(result.pack, static_cast<int>(result.profile.quality(options.quality)->zstd_level));
}

// From the cache or anew.
Expected<std::vector<std::byte>> findOrMakePack(const Scene& scene, const CookOptions& options, Progress& progress,
                                                CookCache* cache, CookResult& result) {
    if (!cache) return makePack(scene, options, progress, cache, result);
    const Key key = packKey(scene, result.profile, options, *cache);
    if (auto entry = cache->findPack(key)) return takePack(std::move(*entry), result);
    auto bytes = makePack(scene, options, progress, cache, result);
    if (bytes)
        cache->keepPack(key, {.pack = *bytes,
                              .bounces = result.stats.bounces,
                              .warnings = result.stats.warnings,
                              .suggested_combinations = result.stats.suggested_combinations,
                              .parts = {},
                              .depends = {},
                              .fitted = result.fitted});
    return bytes;
}

uint64_t headerHash(std::span<const std::byte> pack) {
    format::Header header{};
    std::memcpy(&header, pack.data(), sizeof(header));
    return header.xxh64;
}

// A cache beside the pack may have taken the room that the pack needs.
Expected<void> writePack(const CookOptions& options, std::span<const std::byte> bytes, CookCache* cache,
                         std::vector<std::string>& warnings) {
    auto written = writeFileAtomically(options.pack, bytes);
    std::error_code unknown;
    const auto folder = std::filesystem::absolute(options.pack).parent_path();
    const auto space = std::filesystem::space(folder, unknown);
    if (written || unknown || space.available >= bytes.size() || !cache) return written;
    if (!cache->removeKeptFor(folder, bytes.size() - space.available)) return written;
    written = writeFileAtomically(options.pack, bytes);
    if (written)
        warnings.push_back(
            fmt::format("{}: there was room for the pack alone: what this cook had put into the cache was "
                        "removed again. Free some, or set --cache or --no-cache.",
                        options.pack.string()));
    return written;
}

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
        const Stopwatch watch(result.stats.seconds["import"]);
        scene = importLevel(options.level);
    }
    if (!scene) return std::unexpected(scene.error());
    result.stats.warnings = scene->warnings;
    if (options.quality_is_chosen) profile->origin["quality"] = "command line";
    auto idle = resolveSettings(*profile, *scene, options.set);
    if (!idle) return std::unexpected(idle.error());
    for (std::string& warning : otherQualities(*profile, options.quality)) idle->push_back(std::move(warning));
    if (hidesFile(options.profile))
        idle->push_back(fmt::format(
            "--profile {0} is the shipped one, and the file of that name is not read; --profile ./{0} reads it",
            options.profile));
    // The scene's, too: a pack in the cache is that of the same warnings.
    for (auto* warnings : {&result.stats.warnings, &scene->warnings})
        warnings->insert(warnings->end(), idle->begin(), idle->end());
    for (const std::string& warning : result.stats.warnings) progress.warn(warning);
    result.profile = *profile;
    result.grid_wanted = wantsGrid(*profile, *scene);
    auto cache = openCache(options, result.stats);
    const auto bytes = findOrMakePack(*scene, options, progress, cache ? &*cache : nullptr, result);
    if (cache) {
        cache->finish(options.cache_bytes_max);
        result.stats.cache = cache->lines();
        for (const std::string& w : cache->warnings()) result.stats.warnings.push_back(w);
    }
    if (!bytes) return std::unexpected(bytes.error());
    {
        const Stopwatch watch(result.stats.seconds["write"]);
        result.file_bytes = bytes->size();
        result.header_hash = headerHash(*bytes);
        if (auto ok = writePack(options, *bytes, cache ? &*cache : nullptr, result.stats.warnings); !ok)
            return std::unexpected(ok.error());
    }
    return {};
}

}  // namespace

Expected<CookResult> cook(const CookOptions& options, Progress& progress, CookResult* failed) {
    CookResult result;
    auto ok = cookInto(result, options, progress);
    result.stats.peak_bytes = peakBytes();
    if (ok) return result;
    if (failed) *failed = std::move(result);
    return std::unexpected(ok.error());
}

}  // namespace dimmer::cook
