// From charts to light: what every term (light group and door states) adds at every receiver.
#pragma once

#include <bake/gather.h>
#include <bake/progress.h>
#include <pack/grid_data.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// The global grid: see probes/placement.h.
struct GridSettings {
    uint32_t probes_max = 0;     // 0: no grid
    float probes_per_m3 = 0;     // of open space, at most; 0: one, in small levels more
    float min_spacing_m = 0.3f;  // of probes that see each other; twice that outside of play areas, where there are any
    uint32_t sites = 16;         // per probe, where light is traced: for placing probes, and for fitting their light
    uint32_t site_rays = 256;    // from each, all around, at least: they leave some 5 % of noise in irradiance
    float tolerance = 0.07f;     // no probe where interpolation misses the light by less than this share of it
    bool uniform = false;        // a lattice of about probes_max probes instead: to measure placement against
    bool fit = true;  // false: probes keep the light that was traced at them, for measuring what the fit is worth
    bool visibility = true;  // false: without tables of what probes see, for measuring them
};

struct BakeSettings {
    uint32_t series_rays = 32;     // per texel, for the bounces; kept as links of 2 to 3 bytes while the series runs
    uint32_t final_rays = 128;     // per texel and term at most, for what is stored
    uint32_t emitter_samples = 8;  // per round of final rays, towards each light group's emitters
    float noise_max = 0;           // a term's rays at a texel end when the 95 % interval is within this share; 0: never
    bool denoise = false;          // filter what noise is left, in lightmap space
    bool sharpen = false;          // texels as bilinear filtering needs them (bake/sharpen.h), not their means
    uint32_t bounces_max = 64;
    float tail_max = 0.002f;                   // stop when less of places' light is still to come, in the mean
    float threshold = 0.01f;                   // activity, as a share of a term's mean; see TermReport
    std::vector<float> group_thresholds = {};  // the same for each light group; empty: one for all
    float door_share = 0.2f;  // 0..1: a term with doors has at least this share of its group's threshold
    uint32_t seed = 1;
    // Shadow rays only to the lights that reach a receiver's surroundings (bake/light_grid.h); off, to all of them.
    bool light_grid = true;
    // The final gather once per light group, as bakers do that know nothing of sharing rays: the same result, for
    // measuring against.
    bool per_set_passes = false;

    // Per light group, how bright it is in the level, where the scene has it at another scale: by this the groups count
    // together when pairs of doors are judged. Empty: as the scene has them.
    std::vector<float> group_brightness = {};

    GridSettings grid = {};

    float thresholdOf(uint32_t group) const { return group_thresholds.empty() ? threshold : group_thresholds[group]; }
};

// What is stored for one (receiver, term).
template <class Light>
struct LightOfTerm {
    uint32_t term = 0;
    Light light;
    float variance = 0;  // of the luminance of the irradiance, lux^2; Monte Carlo noise alone
    float keep = 0;      // the largest activity threshold at which it is stored; infinite for always-on light
};
using ReceiverLight = LightOfTerm<Gathered>;
using ProbeTermLight = LightOfTerm<ProbeLight>;

// Light groups are measured over the receivers that they light directly, by their indirect light; terms with doors over
// the receivers that see one of the doors, by what is stored. The threshold of those is a share of what the group's
// light around the door changes with it (see activity.cpp), within limits: at most the group's own threshold, or that
// share of all of the group's light around the door where this is more; at least BakeSettings::door_share of that.
struct TermReport {
    uint64_t receivers = 0;  // active ones
    uint64_t measured_over = 0;
    float mean_lux = 0;  // luminance
    float threshold_lux = 0;
    // Always-on light through doors ends at that share of what is there of its own group's with all doors closed (that
    // of another would make a group's light another one's matter, and a cache keeps each by itself), within these two
    // limits; all else at threshold_lux.
    float dark_threshold_lux = 0, share_of_always_on = 0;
    double energy = 0;          // luminous flux arriving as storable light, lm, estimated by the series
    double energy_dropped = 0;  // share of it where neither the term is active nor one that takes it along, 0..1
};

// How far light in the open is off with so many probes: see gridError(), its mean over places all over the level.
struct ProbesError {
    uint32_t probes = 0;
    float error = 0;
};

struct BakedGrid {
    GlobalGrid grid;               // empty: there is none
    Sparse<ProbeTermLight> light;  // per position of the grid: always-on light first, then the active terms
    double free_volume_m3 = 0;     // of the level: what lies in the open
    // As measured while it grew, to its last probe and the error with all of them; empty where it did not grow.
    std::vector<ProbesError> errors;
};

// Two doors whose light depends on how both stand, while no combination covers them.
struct DoorPair {
    uint32_t first = 0, second = 0;  // into Scene::doors
    // What is off without the combination while both are open, measured with few rays: luminous flux over paths that
    // need one open and ask how the other stands, over all that opening the lesser of the two alone changes; infinite
    // where that is hardly anything.
    float loss = 0;
};

// Luminous flux of one light group over paths that need doors, lm: by it pairs of doors are judged.
struct DoorFlux {
    struct Pair {
        uint32_t first = 0, second = 0;
        double flux = 0;  // needs one open, and the other open or closed: off while both are open
    };
    std::vector<double> alone;  // per door: what opening it changes while all others are closed
    std::vector<Pair> pairs;    // that some surface sees together and no combination covers
};

struct Baked {
    Sparse<ReceiverLight> light;      // per receiver: always-on light first, then the active terms
    std::vector<Term> terms;          // as DoorPaths lists them
    std::vector<TermReport> reports;  // per term
    uint32_t bounces = 0;             // of the light group that took most
    uint64_t rays = 0;                // traced, not remembered
    std::vector<DoorFlux> door_flux;  // per light group
    BakedGrid grid;
    Sparse<ProbeTermLight> local_light;     // per probe of localGrids() (models/scene_models.h), as in `light`
    std::vector<DoorPair> dependent_doors;  // whose loss is above the threshold, the largest first
    std::vector<std::string> warnings;
};

// Places in the open at which the global grid asks for light: all over the level, at surfaces, or around a lamp. See
// probes/site_choice.h.
struct SiteBlock {
    std::vector<glm::vec3> places_m;
    uint32_t rays = 0;  // from each place
};

// All that a bake finds out about one light group. It depends on that group, the level's geometry and the settings
// alone, so that a store can keep it.
struct GroupLight {
    Sparse<ReceiverLight> light;         // per receiver; `term` counts the group's own terms, variances are 0
    Sparse<ProbeTermLight> local_light;  // per probe of local grids, likewise
    std::vector<TermReport> reports;     // per term of the group
    DoorFlux door_flux;
    uint32_t bounces = 0;
};

// Where finished groups are kept from one bake to the next.
class GroupStore {
   public:
    virtual ~GroupStore() = default;
    // Groups that are found are not baked again.
    virtual std::optional<GroupLight> find(uint32_t group) = 0;
    virtual void keep(uint32_t group, const GroupLight& light) = 0;

    // For the global grid. Whole, when no group's light changed but for its brightness.
    virtual std::optional<BakedGrid> findGrid() = 0;
    virtual void keepGrid(const BakedGrid& grid) = 0;
    // Places in the open of this geometry, of one kind: `what` tells it from others.
    virtual std::optional<std::vector<glm::vec3>> findPlaces(std::span<const float> what) = 0;
    virtual void keepPlaces(std::span<const float> what, std::span<const glm::vec3> places) = 0;
    // The light of a group at the places of each block: what is active there; `term` counts the group's own. No rows:
    // not known.
    virtual std::vector<Sparse<ProbeTermLight>> findSites(uint32_t group, std::span<const SiteBlock> blocks) = 0;
    // `fresh`: which of them are new.
    virtual void keepSites(uint32_t group, std::span<const SiteBlock> blocks,
                           std::span<const Sparse<ProbeTermLight>> light, std::span<const size_t> fresh) = 0;
    // Series::radiance, of the group's own terms: what light at new places is gathered from.
    virtual std::optional<SparseLight> findRadiance(uint32_t group) = 0;
    virtual void keepRadiance(uint32_t group, const SparseLight& radiance) = 0;

    // Where rays of some kind end, from so many rows, that may read so many receivers over so many paths. `places`:
    // what they start from, where that is no receiver of the level.
    virtual std::optional<RayEnds> findRays(std::string_view kind, std::span<const glm::vec3> places, size_t rows,
                                            uint32_t receivers, uint32_t paths) = 0;
    virtual void keepRays(std::string_view kind, std::span<const glm::vec3> places, const RayEnds& ends) = 0;
};

// The series expansion of the rendering equation over the lightmap itself: direct light once, then links between
// receivers traced once and followed bounce after bounce, then one gather of many rays that is kept.
// Deterministic for any number of threads, and whatever a store already has. Memory: 2 to 3 bytes * series_rays per
// texel, plus what is active. Models whose transfers were not found (models/self_visibility.h) get what was gathered at
// their probes.
Baked bake(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const BakeSettings& settings,
           Progress& progress, GroupStore* store = nullptr);

}  // namespace dimmer::cook
