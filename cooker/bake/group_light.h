// A bake taken apart by light group, and put together again.
#pragma once

#include <bake/bake.h>

namespace dimmer::cook {

// What `baked` holds of one group. `bounces`: per light group.
GroupLight lightOfGroup(const Baked& baked, uint32_t group, uint32_t bounces);

// Adds groups to those that `baked` holds already. Null: none.
void addGroups(std::span<const std::optional<GroupLight>> groups, Baked& baked);

// The group's own of what leaves receivers (Series::radiance); `term` counts the group's own.
SparseLight radianceOfGroup(const SparseLight& radiance, const DoorPaths& paths, uint32_t group);

// Adds such groups to `radiance`, which has other groups' or no rows at all.
void addRadiance(std::span<const std::optional<SparseLight>> groups, const DoorPaths& paths, size_t receivers,
                 SparseLight& radiance);

}  // namespace dimmer::cook
