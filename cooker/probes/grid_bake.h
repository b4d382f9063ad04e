// The global grid of a bake: placed, and lit term by term.
#pragma once

#include <bake/series.h>

namespace dimmer::cook {

// Probes are receivers as texels are: the same terms, the same thresholds, by the mean irradiance over all normals; the
// same light at the ends of their rays. Corners of the grid's box that stand in geometry have the light of the nearest
// probe. Adds the grid and its rays to `out`.
Expected<void> bakeGrid(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                        Progress& progress, Baked& out);

}  // namespace dimmer::cook
