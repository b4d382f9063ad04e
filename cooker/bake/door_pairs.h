// Which pairs of doors depend on each other so much that the level should name their combination.
#pragma once

#include <bake/bake.h>

#include <vector>

namespace dimmer::cook {

struct DoorPair {
    uint32_t first = 0, second = 0;  // into Scene::doors
    // Luminous flux over paths that need both doors, over that which needs only the one of the two with less: what is
    // lost without the combination.
    float loss = 0;
};

// The pairs that some surface sees together, that no combination covers and whose loss is above `loss_min`, the largest
// loss first. Measured by a series of few rays with those pairs kept: a few per cent of a bake.
std::vector<DoorPair> dependentDoors(const RayScene& rays, const Unwrap& unwrap, const Texels& texels,
                                     const BakeSettings& settings, float loss_min, Progress& progress);

}  // namespace dimmer::cook
