// Which pairs of doors depend on each other so much that the level should name their combination.
#pragma once

#include <bake/series.h>

#include <vector>

namespace dimmer::cook {

// The pairs that some surface sees together, that no combination covers and whose loss is above the threshold, the
// largest loss first. `series` is the bake's own. Measured by another of few rays with those pairs kept; where no pair
// is seen, it costs nothing.
std::vector<DoorPair> dependentDoors(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                                     Progress& progress);

}  // namespace dimmer::cook
