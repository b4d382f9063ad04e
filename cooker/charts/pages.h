// Charts on pages.
#pragma once

#include <charts/unwrap.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace dimmer::cook {

// Gives charts of these sizes, padding included, their places in Unwrap::charts, and the pages their size: as few as
// will do, and those as small as will do. Sides are multiples of 64 texels. False where more than 256 would be needed.
bool packPages(std::span<const glm::uvec2> charts, uint32_t page_size, Unwrap& out);

// Texels of the pages that charts of these sizes fill, as unwrap() packs them; UINT64_MAX: of too many pages.
uint64_t pageTexels(std::span<const glm::uvec2> charts, uint32_t page_size);
// About the size of a chart, padding included, whose texels are `factor` times as long.
glm::uvec2 chartSize(glm::uvec2 size, double factor);

}  // namespace dimmer::cook
