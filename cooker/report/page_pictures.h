// Pictures of lightmap pages for the report.
#pragma once

#include <dimmer/pack.h>

#include <dimmer/error.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace dimmer::cook {

// Colours of 0, 1, 2, ... contributions at a texel; the last one stands for all above.
inline constexpr std::array<std::array<uint8_t, 3>, 9> overlap_colours = {{{24, 24, 27},
                                                                           {49, 54, 149},
                                                                           {69, 117, 180},
                                                                           {116, 173, 209},
                                                                           {171, 217, 233},
                                                                           {254, 224, 144},
                                                                           {253, 174, 97},
                                                                           {244, 109, 67},
                                                                           {215, 48, 39}}};

// "data:image/png;base64,...", one for each page, of at most `side_max` texels a side: every n-th texel then.
struct PagePictures {
    uint32_t side_max;

    // All light sets at 1 (or their maximum), doors closed; brightened so that the median lit texel is a middle grey.
    Expected<std::vector<std::string>> light(const Pack& pack) const;
    Expected<std::vector<std::string>> overlap(const Pack& pack) const;
    // Where an element's contributions are stored, at weight 1: from 64 (faint) to 255 over four powers of ten below
    // its brightest; 0 where there is none. Pages without any are empty texts.
    Expected<std::vector<std::string>> region(const Pack& pack, uint32_t element) const;
};

std::string base64(std::span<const std::byte> bytes);

}  // namespace dimmer::cook
