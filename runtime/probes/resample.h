// Probes of moving things, taken from the global grid.
#pragma once

#include <pack/pack_data.h>

#include <dimmer/work_list.glsl>

#include <array>
#include <cstdint>
#include <span>

namespace dimmer {

// The probe that stands at `point_m`: the blend of its tetrahedron's four in `probes` (7 words each, by number), in the
// order of the tetrahedron, with probeWeights(). `tetrahedron`: a hint in, where the point lies out. The grid is not
// empty.
ProbeRecord resampleProbe(const PackData& data, std::span<const uint32_t> probes, std::array<float, 3> point_m,
                          uint32_t& tetrahedron);

// The probes of an item, which stand in a lattice. `hints`: a tetrahedron per moving probe, whose numbers begin at
// `first_moving`. The twin of shaders/resample_probes.comp.
void resampleItem(const PackData& data, const ResampleItem& item, uint32_t first_moving, std::span<uint32_t> probes,
                  std::span<uint32_t> hints);

}  // namespace dimmer
