// How a cluster's texels are cut into batches, and where a batch's texels lie.
#pragma once

#include <pack/pack_data.h>

#include <array>
#include <bit>
#include <optional>
#include <span>
#include <vector>

namespace dimmer {

// A batch lies in at most four 8x8 tiles of one page, so that a byte per receiver says where it is: which tile, and
// where in it. Any two tiles will do, as lanes take two receivers at a time; a third and a fourth come soon after the
// one before, as in the order of pages, so that all four are told in 60 bits.
inline constexpr uint32_t batch_tiles_max = 4;
inline constexpr uint32_t tile_side = 8;
inline constexpr uint32_t tile_step_end = 1 << 12;  // above a step to a third or fourth tile

// A tile's number in its page is row << tileColumnBits() | column: at most 18 bits.
constexpr uint32_t tileColumnBits(uint32_t page_width) {
    return page_width == 0 ? 0 : static_cast<uint32_t>(std::bit_width((page_width - 1) / tile_side));
}

struct BatchTiles {
    explicit BatchTiles(uint32_t page_width) : column_bits(tileColumnBits(page_width)) {}

    uint32_t column_bits;
    uint32_t page = 0;
    std::array<uint32_t, batch_tiles_max> tiles = {};  // in order of appearance
    uint32_t tile_count = 0;
    // Takes the receiver in and returns its byte: index of its tile << 6 | row in the tile << 3 | column. Nothing
    // where the batch has no tile left for it, ends too far before it, or lies on another page.
    std::optional<uint8_t> add(uint32_t address);
};

// Cuts the receivers from `first_receiver` to the last, one cluster's on one page, into batches: as many in each as
// fit, and an even number in all but the last, as lanes take two at a time.
void cutIntoBatches(std::span<const uint32_t> addresses, uint32_t page_width, uint32_t first_receiver,
                    std::vector<Batch>& batches, uint32_t receivers_max = batch_receivers_max);

// How many of the receivers lie on the first one's page, from the first on: a cluster ends where its page does.
size_t countOnPage(std::span<const uint32_t> addresses);

}  // namespace dimmer
