// Receivers with the same list of contributions, or nearly the same (cluster/merge.h), become clusters, cut into
// batches.
#pragma once

#include <bake/bake.h>
#include <charts/texels.h>
#include <pack/pack_data.h>

#include <span>

namespace dimmer::cook {

// Fills base_pages, contributions' receivers, clusters, terms, batches, addresses and payload of `pack`, whose page
// size, exposure and contributions are set. `contribution_of_term`: of every term that some receiver has, but the
// first, which is the base; ascending as the terms do. Within a cluster receivers follow the 8x8 tiles of their page,
// so that a batch writes few cache lines. A receiver that lacks a contribution of its cluster has a record without
// light. `overlap_max`: of the profile; no cluster has more contributions.
void buildClusters(const Texels& texels, const Baked& baked, std::span<const uint32_t> contribution_of_term,
                   uint32_t overlap_max, PackData& pack);

// The same for light probes, global ones first: fills pack.probes but its local grids. Within a cluster probes follow
// their numbers.
void buildProbeClusters(const Baked& baked, std::span<const uint32_t> contribution_of_term, uint32_t overlap_max,
                        PackData& pack);

}  // namespace dimmer::cook
