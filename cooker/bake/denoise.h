// Filters Monte Carlo noise in lightmap space.
#pragma once

#include <bake/bake.h>

namespace dimmer::cook {

// An edge-avoiding a-trous wavelet filter (Dammertz et al. 2010), guided by each texel's own variance: texels are
// averaged with others of the same chart, the less the more their light of the same group differs for the noise of
// both. A chart that came with the level may hold many islands, and curved ones: only what goes on one surface, and
// tells directions by the same tangent frame, is averaged. Light groups are filtered apart. Deterministic.
Sparse<ReceiverLight> denoise(const RayScene& rays, const Unwrap& unwrap, const Texels& texels,
                              Sparse<ReceiverLight> light, Progress& progress);

}  // namespace dimmer::cook
