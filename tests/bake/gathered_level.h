// A scene and what gathers its light.
#pragma once

#include <bake/baked_scene.h>
#include <bake/door_pairs.h>
#include <bake/emitters.h>
#include <bake/gather.h>

namespace dimmer::cook::test {

struct GatheredLevel {
    explicit GatheredLevel(const Scene& scene, float texels_per_metre = 4)
        : b(scene, texels_per_metre),
          paths(b.scene, doorsInSight(*b.rays)),
          emitters(*b.rays, meshGroups(b.scene)),
          gatherer(*b.rays, b.charts, b.texels, emitters, paths) {}

    BakedScene b;
    DoorPaths paths;
    EmitterSampler emitters;
    Gatherer gatherer;
};

}  // namespace dimmer::cook::test
