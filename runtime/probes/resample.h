// Probes of moving things, taken from the global grid.
#pragma once

#include <pack/pack_data.h>

#include <array>
#include <cstdint>
#include <span>

namespace dimmer {

// The probe that stands at `point_m`: the blend of its tetrahedron's four in `probes` (7 words each, by number), in the
// order of the tetrahedron, with probeWeights(). `tetrahedron`: a hint in, where the point lies out. The grid is not
// empty.
ProbeRecord resampleProbe(const PackData& data, std::span<const uint32_t> probes, std::array<float, 3> point_m,
                          uint32_t& tetrahedron);

}  // namespace dimmer
