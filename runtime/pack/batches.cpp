#include <pack/batches.h>

#include <algorithm>

namespace dimmer {
namespace {

bool isSoonAfter(uint32_t before, uint32_t tile) {
    return tile >= before && tile - before < tile_step_end;
}

}  // namespace

std::optional<uint8_t> BatchTiles::add(uint32_t address) {
    if (tile_count > 0 && TexelAddress::page(address) != page) return std::nullopt;
    const uint32_t tile = TexelAddress::y(address) / tile_side << column_bits | TexelAddress::x(address) / tile_side;
    uint32_t slot = 0;
    while (slot < tile_count && tiles[slot] != tile) ++slot;
    if (slot == batch_tiles_max || (slot > 1 && !isSoonAfter(tiles[slot - 1], tile))) return std::nullopt;
    if (slot == tile_count) {
        page = TexelAddress::page(address);
        tiles[tile_count++] = tile;
    }
    return static_cast<uint8_t>(slot << 6 | (TexelAddress::y(address) % tile_side) << 3 |
                                TexelAddress::x(address) % tile_side);
}

void cutIntoBatches(std::span<const uint32_t> addresses, uint32_t page_width, uint32_t first_receiver,
                    std::vector<Batch>& batches, uint32_t receivers_max) {
    const auto end = static_cast<uint32_t>(addresses.size());
    while (first_receiver < end) {
        BatchTiles tiles(page_width);
        uint32_t count = 0;
        while (count < receivers_max && first_receiver + count < end && tiles.add(addresses[first_receiver + count]))
            ++count;
        if (count > 1 && first_receiver + count < end) count -= count % 2;
        batches.push_back({first_receiver, count});
        first_receiver += count;
    }
}

size_t countOnPage(std::span<const uint32_t> addresses) {
    const auto elsewhere = [&](uint32_t a) { return TexelAddress::page(a) != TexelAddress::page(addresses[0]); };
    return static_cast<size_t>(std::ranges::find_if(addresses, elsewhere) - addresses.begin());
}

}  // namespace dimmer
