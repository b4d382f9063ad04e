// Receivers with the same list of contributions become clusters, cut into batches.
#pragma once

#include <bake/bake.h>
#include <charts/texels.h>
#include <pack/pack_data.h>

#include <span>

namespace dimmer::cook {

// Fills base_pages, contributions' receivers, clusters, terms, batches, addresses and payload of `pack`, whose page
// size, exposure and contributions are set. `contribution_of_term`: of every term that some receiver has, but the
// first, which is the base; ascending as the terms do. Within a cluster receivers follow the 8x8 tiles of their page,
// so that a batch writes few cache lines.
void buildClusters(const Texels& texels, const Baked& baked, std::span<const uint32_t> contribution_of_term,
                   PackData& pack);

// The same for light probes, global ones first: fills pack.probes but its local grids. Within a cluster probes follow
// their numbers.
void buildProbeClusters(const Baked& baked, std::span<const uint32_t> contribution_of_term, PackData& pack);

}  // namespace dimmer::cook
