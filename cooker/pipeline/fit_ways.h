// The single ways to make a pack smaller, of which fit.h makes remedies: thresholds, density, probes. A remedy without
// changes is none.
#pragma once

#include <pipeline/budget.h>
#include <pipeline/losses.h>
#include <pipeline/remedy.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {

inline double ratio(uint64_t a, uint64_t b) {
    return static_cast<double>(a) / static_cast<double>(std::max<uint64_t>(b, 1));
}

inline uint64_t scaledBytes(uint64_t bytes, double share) {
    return static_cast<uint64_t>(std::llround(static_cast<double>(bytes) * share));
}

inline bool gridIsOver(const PackCost& cost, const Profile& profile) {
    return isOver(cost.global_grid, profile.budget_global_grid);
}

inline bool localGridsAreOver(const PackCost& cost, const Profile& profile) {
    return isOver(cost.local_grids, profile.budget_local_grids);
}

inline bool baseIsOver(const PackCost& cost, const Profile& profile) {
    return isOver(cost.base_lightmap, profile.budget_base_lightmaps);
}

// Whether a budget of records, pages or all is exceeded, which thresholds and density help with.
bool pagesOrRecordsAreOver(const PackCost& cost, const Profile& profile);

// Always the step that loses the least light for the bytes that the exceeded budget is over by. None where pages are
// over, or nothing that thresholds help with.
Remedy byThresholds(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses);
// The first rung at which everything fits, of all groups or of the set with the most records.
Remedy byThresholdOfAll(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses);
Remedy byLargestSet(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses);
bool fitsAtHighestThresholds(const PackData& pack, const PackCost& cost, const Profile& profile,
                             const LossTable& losses);

// `steps_before`: where two steps fell short already, it goes further than it takes.
Remedy byDensity(const PackCost& cost, const Profile& profile, const LossTable& losses, size_t steps_before);

// What a share of the probes of the global grid would cost.
PackCost withProbesLeft(PackCost cost, double left);
// The least share that toProbes() can go to; 1 where none may go.
double leastProbesLeft(const PackData& pack);
// Fewer probes, as bytes go with their number: `left` of them, a share, or a little less.
Remedy toProbes(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
                double left);
// Where the grid's own budget is exceeded, or the total by no more than probes can save.
Remedy byProbes(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses);
// Fewer probes for the models that have most: the largest number at which all fit.
Remedy byLocalProbes(const PackData& pack, const PackCost& cost, const Profile& profile);

}  // namespace dimmer::cook
