// A bake taken apart by light group, and put together again.
#pragma once

#include <bake/bake.h>

namespace dimmer::cook {

// Whether light that a store had is of this level: so many texels and probes of models, no terms but the group's own.
bool fits(const GroupLight& light, const DoorPaths& paths, uint32_t group, size_t texels, size_t probes);

// What `baked` holds of one group. `bounces`: the group's.
GroupLight lightOfGroup(const Baked& baked, const DoorPaths& paths, uint32_t group, uint32_t bounces);

// Adds groups to those that `baked` holds already. Null: none.
void addGroups(std::span<const std::optional<GroupLight>> groups, const DoorPaths& paths, Baked& baked);

// The group's own of what leaves receivers (Series::radiance); `term` counts the group's own.
SparseLight radianceOfGroup(const SparseLight& radiance, const DoorPaths& paths, uint32_t group);

// Adds such groups to `radiance`, which has other groups' or no rows at all.
void addRadiance(std::span<const std::optional<SparseLight>> groups, const DoorPaths& paths, SparseLight& radiance);

}  // namespace dimmer::cook
