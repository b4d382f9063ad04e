// Where the probes of the global grid stand.
#pragma once

#include <probes/sites.h>

#include <vector>

namespace dimmer::cook {

struct Placement {
    GlobalGrid grid;  // with visibility and levels; empty where nothing is free
    // Per position, the one whose light it has: its own; for corners of the box that lie in geometry or outside of the
    // level, the nearest that is free.
    std::vector<uint32_t> sources;
    // The places where light was traced, probes included; shares are of `sources`.
    std::vector<FitSite> sites;
    std::vector<SiteLight> light;
    double free_volume_m3 = 0;
};

// Light is traced at free sites all over the level. A few, far apart, become probes; then, round after round, the grid
// is asked for the light at all others, and in the tetrahedra that are wrong the most the worst site becomes a probe
// too, until no site is wrong by more than the tolerance, or the probes are as many as the settings allow, or one per
// cubic metre of free space. Then those that do least are exchanged for others. Probes that see each other keep their
// distance. Deterministic.
Expected<Placement> placeProbes(const Sites& sites, const GridSettings& settings, Progress& progress);

}  // namespace dimmer::cook
