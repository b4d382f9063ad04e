// The whole cook: level in, pack out. main() and the tests call the same functions.
#pragma once

#include <bake/bake.h>
#include <pack/pack_data.h>
#include <pipeline/cook_cache.h>
#include <pipeline/fit.h>
#include <pipeline/profile.h>
#include <pipeline/stage_timer.h>
#include <scene/scene.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace dimmer::cook {

struct CookOptions {
    std::filesystem::path level, pack;
    std::string profile = "desktop";
    std::string quality = "preview";
    bool quality_is_chosen = true;      // on the command line, as the pack's settings then say
    std::vector<std::string> set = {};  // "key=value": settings that go before the level's and the profile's
    uint32_t threads = 0;               // 0: as many as the machine has
    bool per_set_passes = false;  // one final gather per light group: a baseline to measure the shared one against
    // To measure the global grid against: "uniform" (a lattice of as many probes), "unfitted" (light as traced at the
    // probes themselves) or "unseen" (no tables of what probes see); empty: as it should be.
    std::string grid_baseline = {};
    bool light_grid = true;            // false: shadow rays to every light from everywhere, see BakeSettings
    std::filesystem::path cache = {};  // folder of what earlier cooks found out; empty: nothing is kept
    uint64_t cache_bytes_max = uint64_t{4} << 30;
    bool fit = false;                         // over budget: change settings until it fits; see CookResult::fitted
    std::optional<float> fit_error_max = {};  // the mean error, a share, that `fit` may add at most, as predicted
};

struct CookStats {
    std::map<std::string, double> seconds;  // per stage
    StageSeconds bake_seconds;              // of "bake", what its stages took; not what reads and keeps entries
    uint64_t rays = 0;                      // of every round of a fit, as the seconds are
    uint32_t bounces = 0;
    double free_volume_m3 = 0;  // of the level, where probes may stand
    uint64_t peak_bytes = 0;    // of the whole process
    // For `dimmer_combinations`: doors, as the level writes them, that lose or may lose light for want of it.
    std::vector<std::vector<std::string>> suggested_combinations;
    std::vector<std::string> warnings;
    std::vector<CacheLine> cache;  // per stage that a cache could keep; empty without one
};

// Bakes a scene that is already in memory. Deterministic: the same scene and settings give the same data, whatever the
// cache has. `losses`: takes what raising thresholds would do, where the pack is over a budget of the profile.
Expected<PackData> cookScene(Scene scene, const Profile& profile, const std::string& quality, Progress& progress,
                             CookStats& stats, CookCache* cache = nullptr, LossTable* losses = nullptr);

struct CookResult {
    PackData pack;
    Profile profile;               // as resolved, and fitted
    std::vector<Remedy> fitted;    // what had to be changed, in the order of the cooks that it took
    std::vector<Remedy> remedies;  // over budget: ways out
    bool grid_wanted = false;      // the global one, by profile and level
    uint64_t file_bytes = 0;
    uint64_t header_hash = 0;  // of the file, see format::Header
    CookStats stats;
};

// Reads the level, bakes, checks the budgets, writes the pack. On any error nothing is written; `failed`, if given,
// takes what there was until then: warnings at least, over budget all but the file.
Expected<CookResult> cook(const CookOptions& options, Progress& progress, CookResult* failed = nullptr);

}  // namespace dimmer::cook
