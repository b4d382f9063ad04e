// How a cluster's texels are cut into batches, and where a batch's texels lie.
#pragma once

#include <pack/pack_data.h>

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace dimmer {

// A batch lies in at most four 8x8 tiles of one page, so that a byte per receiver says where it is: which tile, and
// where in it. Cost: 4 bytes per tile and batch against 4 per receiver.
inline constexpr uint32_t batch_tiles_max = 4;
inline constexpr uint32_t tile_side = 8;

// The tile of a TexelAddress within its page, row << 9 | column.
constexpr uint32_t tileOf(uint32_t address) {
    return TexelAddress::y(address) / tile_side << 9 | TexelAddress::x(address) / tile_side;
}

struct BatchTiles {
    uint32_t page = 0;
    std::array<uint32_t, batch_tiles_max> tiles = {};  // in order of appearance
    uint32_t tile_count = 0;
    // Takes the receiver in and returns its byte: index of its tile << 6 | row in the tile << 3 | column. Nothing
    // where the batch has no tile left for it, or lies on another page.
    std::optional<uint8_t> add(uint32_t address);
};

// Cuts the receivers from `first_receiver` to the last, one cluster's on one page, into batches: as many in each as
// fit, and an even number in all but the last, as lanes take two at a time.
void cutIntoBatches(std::span<const uint32_t> addresses, uint32_t first_receiver, std::vector<Batch>& batches,
                    uint32_t receivers_max = batch_receivers_max);

// How many of the receivers lie on the first one's page, from the first on: a cluster ends where its page does.
size_t countOnPage(std::span<const uint32_t> addresses);

}  // namespace dimmer
