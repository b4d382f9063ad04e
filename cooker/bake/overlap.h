// How many contributions one receiver may hold: an update of it costs what they all cost.
#pragma once

#include <bake/bake.h>

namespace dimmer::cook {

// Leaves every texel and probe with its always-on light and the `most` contributions that have most light there, by
// luminance at weight 1; 0: as many as there are. What goes of a term's light on texels, of these areas, is added to
// its report.
void limitOverlap(Baked& baked, std::span<const float> area_m2, uint32_t most);

}  // namespace dimmer::cook
