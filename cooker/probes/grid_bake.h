// The global grid of a bake: placed, and lit term by term.
#pragma once

#include <probes/sites.h>

namespace dimmer::cook {

// Probes stand where `light`, per place of `choice`, is hardest to interpolate, and hold what fits it best. They are
// receivers as texels are: the same terms, the same thresholds, by the mean irradiance over all normals. Corners of the
// grid's box that stand in geometry have the light of the nearest probe.
Expected<BakedGrid> bakeGrid(const RayScene& rays, const SiteChoice& choice, const Sparse<ProbeTermLight>& light,
                             std::span<const Term> terms, const GridSettings& settings, Progress& progress);

}  // namespace dimmer::cook
