// What the stages of a cook depend on, as keys.
#pragma once

#include <bake/bake.h>
#include <cache/key.h>
#include <charts/unwrap.h>
#include <probes/tetrahedra.h>
#include <scene/scene.h>

#include <span>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// Meshes, doors and materials without what they emit: all that decides where receivers are and what rays meet. Without
// the names of nodes and materials, which entries must not hold.
Key geometryKey(const Scene& scene);

// Everything in a level.
Key sceneKey(const Scene& scene);

// Charts and receivers.
Key chartsKey(const Key& geometry, const UnwrapOptions& options, uint32_t samples_per_texel);

// The settings that every light group's light depends on, and so neither thresholds nor how passes are arranged.
Key bakeSettingsKey(const BakeSettings& settings);

// The lamps and emitters of a light group, the always-on group's sky included.
Key lampsKey(const Scene& scene, uint32_t group);

// A group's finished light, and what else is kept of it.
Key groupKey(const Key& charts, const Key& settings, float threshold, const Key& lamps);

// What the rays of a bake meet: everything but light, and which faces are emitters.
Key sceneRaysKey(const Key& charts, const Key& settings, const Scene& scene);
// Of some rays, from `places` where they start from no receivers.
Key raysKey(const Key& scene, std::string_view kind, std::span<const glm::vec3> places);

// Of a light group's light at places in the open.
Key sitesKey(const Key& group, std::span<const SiteBlock> blocks);

// Places in the open.
Key placesKey(const Key& scene, std::span<const float> what);

// What the global grid depends on besides the groups' light. `air`: the box that it fills.
Key gridSettingsKey(const GridSettings& settings, const Scene& scene, const Box& air);
// How the groups' lamps take turns in the level: with each group's own, the order of all, by which the grid looks
// around them.
Key lampOrderKey(const Scene& scene);
// The global grid. `groups`: groupKey of each.
Key gridKey(const Key& settings, const Key& lamp_order, std::span<const Key> groups);

}  // namespace dimmer::cook
