// The light of models' own grids.
#pragma once

#include <bake/series.h>

namespace dimmer::cook {

// Per probe of localGrids(), of the light groups whose turn it is (`groups`): gathered as texels are, the model itself
// left out; probes inside of something have the light of the model's nearest that is not. Adds the rays to `rays`.
// Each group's part is the same whichever others there are.
Sparse<ProbeTermLight> bakeLocalGrids(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                                      std::span<const uint8_t> groups, Progress& progress, uint64_t& rays,
                                      std::vector<std::string>& warnings);

}  // namespace dimmer::cook
