// Limits of `dimmer_combinations`.
#pragma once

#include <cstddef>

namespace dimmer::cook {

// Doors of one combination: each may be open, closed or either, so that a light group has 3^8 = 6561 paths of them.
inline constexpr size_t combined_doors_max = 8;

}  // namespace dimmer::cook
