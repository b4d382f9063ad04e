// A bake taken apart by light group, and put together again.
#pragma once

#include <bake/bake.h>

namespace dimmer::cook {

// What `baked` holds of one group. `bounces`: per light group.
GroupLight lightOfGroup(const Baked& baked, uint32_t group, uint32_t bounces);

// Adds groups to those that `baked` holds already. Null: none.
void addGroups(std::span<const std::optional<GroupLight>> groups, Baked& baked);

}  // namespace dimmer::cook
