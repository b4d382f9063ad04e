// Receivers with the same list of contributions become clusters, cut into batches.
#pragma once

#include <bake/bake.h>
#include <charts/texels.h>
#include <pack/pack_data.h>

namespace dimmer::cook {

// Fills base_pages, contributions' receivers, clusters, terms, batches, addresses and payload of `pack`, whose page
// size, exposure and contributions (one per light set, in order) are set. Within a cluster receivers follow the 8x8
// tiles of their page, so that a batch writes few cache lines.
void buildClusters(const Texels& texels, const Baked& baked, PackData& pack);

}  // namespace dimmer::cook
