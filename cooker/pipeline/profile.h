// A profile: the budgets, densities and qualities of a target platform.
#pragma once

#include <dimmer/pack.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace dimmer::cook {

// As profiles name them: "e5b9g9r9", "ahd".
const char* nameOf(ColorFormat format);
const char* nameOf(DirectionModel model);

// Whether a cook bakes the global grid. Auto: where something in the level moves; see wantsGrid() in cook_settings.h.
enum class GridMode { Auto, On, Off };

const char* nameOf(GridMode mode);

struct Quality {
    uint32_t samples_per_texel = 4;  // points of a texel that rays start from
    uint32_t series_rays = 32;       // per texel, for the bounces
    uint32_t rays = 128;             // per texel and light group at most, for what is stored
    uint32_t emitter_samples = 8;    // per 32 rays, towards each light group's emitters
    float noise = 0;                 // rays end when the 95 % interval is within this share of the light; 0: never
    uint32_t denoise = 0;            // 1: filter the noise that is left
    uint32_t sharpen = 1;            // 1: texels as bilinear filtering needs them; 0: their means
    uint32_t lamps_apart = 0;        // groups of at most so many lamps are baked lamp by lamp; see lamps_apart.h
    uint32_t probe_sites = 16;       // per probe of the global grid, see GridSettings
    uint32_t probe_rays = 256;       // likewise
    uint32_t bounces = 64;           // at most
    float tolerance = 0.002f;        // bounces stop when less of places' light is still to come, in the mean
    uint32_t zstd_level = 7;         // of the pack's chunks
    bool per_set_passes = false;     // see BakeSettings; from the command line alone
    bool light_grid = true;          // likewise
    std::string grid_baseline = {};  // likewise; see CookOptions
};

struct Profile {
    // Bytes; 0: no limit.
    uint64_t budget_total = 0, budget_base_lightmaps = 0, budget_dynamic = 0, budget_global_grid = 0,
             budget_local_grids = 0, budget_per_element = 0;
    float texels_per_metre = 4;
    uint32_t page_size = 2048;
    ColorFormat color_format = ColorFormat::E5B9G9R9;
    DirectionModel direction_model = DirectionModel::Ahd;
    float threshold = 0.01f;                      // activity, see BakeSettings
    float door_share = 0.2f;                      // of thresholds, see BakeSettings
    uint32_t overlap_max = 0;                     // contributions per receiver, see limitOverlap; 0: no limit
    std::map<std::string, float> set_thresholds;  // for single light sets, by name
    GridMode global_grid = GridMode::Auto;
    uint32_t probes_max = 20000;        // of the global grid; 0: no grid
    float probes_per_m3 = 0;            // of open space; 0: GridSettings::probes_per_m3
    float global_min_spacing_m = 0.3f;  // between them
    float local_spacing_m = 0.4f;       // between the probes of a model's grid, at most
    uint32_t local_probes_max = 64;     // of one model's grid; above, they stand further apart
    Quality draft, preview, final;

    // Where each setting's value comes from: a shipped profile's name or a file's, "level", "command line", "fit"; what
    // is not listed: "default".
    std::map<std::string, std::string> origin;

    const Quality* quality(const std::string& name) const;
    // Every setting as JSON: {"lightmaps.texels_per_metre": {"value": 4, "from": "desktop"}, ...}.
    std::string settingsJson(const std::string& quality) const;
};

// What settingsJson() wrote: the profile as far as it was used, and the name of the quality.
struct CookSettings {
    Profile profile;
    std::string quality;
};
Expected<CookSettings> readSettings(const std::string& settings_json);

// The same for people: {"name": {"value": .., "from": ".."}, ...}. The text comes from a file: what is not of that
// shape is left out, and what nests deeper is not even built.
nlohmann::ordered_json listedSettings(const std::string& settings_json);

// A shipped profile by name, or a file. A profile changes what it names of the one that it `extends` (a shipped one, or
// a file beside it; "desktop" where it does not say). Unknown keys, wrong types and values out of range are errors that
// name the key.
Expected<Profile> loadProfile(const std::string& name_or_file);
std::vector<std::string> shippedProfiles();

// Whether the name of a shipped profile is that of a file here too, which loadProfile() then does not read.
bool hidesFile(const std::string& name);

// The files that a profile extends, one after another; shipped ones are none. Errors are for loadProfile() to tell.
std::vector<std::filesystem::path> filesExtendedBy(const std::string& name_or_file);

}  // namespace dimmer::cook
