// The whole cook: level in, pack out. main() and the tests call the same functions.
#pragma once

#include <bake/bake.h>
#include <pack/pack_data.h>
#include <pipeline/profile.h>
#include <scene/scene.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace dimmer::cook {

struct CookOptions {
    std::filesystem::path level, pack;
    std::string profile = "desktop";
    std::string quality = "preview";
    uint32_t threads = 0;         // 0: as many as the machine has
    bool per_set_passes = false;  // one final gather per light group: a baseline to measure the shared one against
    // To measure the global grid against: "uniform" (a lattice of as many probes), "unfitted" (light as traced at the
    // probes themselves) or "unseen" (no tables of what probes see); empty: as it should be.
    std::string grid_baseline = {};
    bool light_grid = true;  // false: shadow rays to every light from everywhere, see BakeSettings
};

struct CookStats {
    std::map<std::string, double> seconds;  // per stage
    uint64_t rays = 0;
    uint32_t bounces = 0;
    double free_volume_m3 = 0;  // of the level, where probes may stand
    uint64_t peak_bytes = 0;    // of the whole process
    // For `dimmer_combinations`: pairs of doors, as the level writes them, that lose light for want of it.
    std::vector<std::pair<std::string, std::string>> suggested_combinations;
    std::vector<std::string> warnings;
};

// Bakes a scene that is already in memory. Deterministic: the same scene and settings give the same data.
Expected<PackData> cookScene(Scene scene, const Profile& profile, const std::string& quality, Progress& progress,
                             CookStats& stats);

BakeSettings bakeSettings(const Profile& profile, const Quality& quality);

struct CookResult {
    PackData pack;
    uint64_t file_bytes = 0;
    CookStats stats;
};

// Reads the level, bakes, checks the budgets, writes the pack. On any error nothing is written.
Expected<CookResult> cook(const CookOptions& options, Progress& progress);

}  // namespace dimmer::cook
