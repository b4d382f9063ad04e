// Which pairs of doors see each other, and which depend on each other so much that the level should name their
// combination.
#pragma once

#include <bake/links.h>
#include <bake/series.h>

#include <vector>

namespace dimmer::cook {

// The pairs (first < second) between whose leaves, closed or open, some ray passes: no wall is in its way. The light of
// others hardly asks how both stand. Deterministic; some hundred rays a pair.
std::vector<DoorIndices> doorsInSight(const RayScene& rays);

// The pairs (first < second) of doors that light goes between: some receiver sees either, or another receiver that
// does. So around a bend or two of a corridor, while doors are closed. `doors_seen`: as Series has them.
std::vector<DoorIndices> doorsNear(const Links& links, const Sparse<uint32_t>& doors_seen);

// What a pair adds of terms, by how both doors stand.
constexpr size_t pairTerms(size_t groups) {
    return 4 * groups;
}

// Per light group; of groups that are not asked for, nothing. `series` is the bake's own. Measured by another of few
// rays (termFlux) that keeps the pairs of doors near each other; where there are none, it costs nothing.
// `lights`, `links`: as expandSeries() has them. `terms_at_once`: pairs are kept in so many terms, the bake's own among
// them; what does not fit takes another series. (Light that asks for a third door counts for one pair or another, by
// which pairs are kept together.)
std::vector<DoorFlux> doorFlux(const Gatherer& gatherer, const LightGrid& lights, const Series& series,
                               const BakeSettings& settings, std::span<const uint8_t> groups, Progress& progress,
                               RayEnds* links = nullptr, uint32_t terms_at_once = terms_max);

// The pairs whose loss, over all groups, is above the threshold, the largest first.
std::vector<DoorPair> dependentDoors(std::span<const DoorFlux> flux, const BakeSettings& settings);

}  // namespace dimmer::cook
