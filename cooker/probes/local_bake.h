// The light of models' own grids.
#pragma once

#include <bake/series.h>

namespace dimmer::cook {

// Per probe of localGrids(), of the light groups whose turn it is (`groups`): light is gathered at the probes, the
// model itself left out (probes inside of something start from the light of the model's nearest that is not), and all
// over its surface, the model in the way; probes are fitted to the surface (probes/model_fit.h) where the model has its
// transfers (findTransfers) and at most fitted_probes_max probes. Adds the rays to `rays`. Each group's part is the
// same whichever others there are.
inline constexpr uint32_t fitted_probes_max = 128;
Sparse<ProbeTermLight> bakeLocalGrids(const Gatherer& gatherer, const LightGrid& lights, const Series& series,
                                      const BakeSettings& settings, std::span<const uint8_t> groups, Progress& progress,
                                      uint64_t& rays);
// What is wrong with standing models' grids: by the geometry alone, so that a cook whose light is all cached says it
// too. `places`: of the same rays.
std::vector<std::string> warningsOfLocalGrids(const RayScene& rays, const ProbePlaces& places);

}  // namespace dimmer::cook
