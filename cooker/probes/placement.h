// Where the probes of the global grid stand.
#pragma once

#include <probes/sites.h>

#include <vector>

namespace dimmer::cook {

struct Placement {
    GlobalGrid grid;  // with visibility and levels; empty where nothing is free
    // Per position: the place of SiteChoice whose light it starts from: its own; for corners of the box that lie in
    // geometry or outside of the level, that of the nearest probe.
    std::vector<uint32_t> place_of;
    std::vector<uint8_t> guessed;  // per position: whether it is such a corner
    // The places where light was traced, probes included, without corners.
    std::vector<FitSite> sites;
    std::vector<ProbesError> errors;  // of fewer probes, to all that there are
};

// Of `states`, the light at the places of `choice`. A few places, far apart, become probes; then, round after round,
// the grid is asked for the light at all others (at fewer while a large grid still has few probes), and in the
// tetrahedra that are wrong the most the worst place becomes a probe too, until none is wrong by more than the
// tolerance, or the probes are as many as may be. Then those that do least are exchanged for others, and where they are
// few, single ones move. Probes that see each other keep their distance. Deterministic.
Expected<Placement> placeProbes(const RayScene& rays, const SiteChoice& choice, std::span<const FitValue> states,
                                const GridSettings& settings, Progress& progress);

}  // namespace dimmer::cook
