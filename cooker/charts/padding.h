// What bilinear filtering finds beside a chart's own texels.
#pragma once

#include <charts/texels.h>

#include <vector>

namespace dimmer::cook {

// Completes `texels`: every texel of a chart's rectangle without points of its own gets a receiver that stands in for
// it, the nearest of the chart, found ring by ring; and the ring around what is lit is listed as fills. Where a fill
// lies over another chart of the same plane, and no wall stands between, it copies that chart's texel instead: then
// filtering runs on across the seam as if there were none. `covered`: per page texel, whether a face touches it.
void fillPadding(const RayScene& rays, const Unwrap& unwrap, const std::vector<uint8_t>& covered, Texels& texels);

}  // namespace dimmer::cook
