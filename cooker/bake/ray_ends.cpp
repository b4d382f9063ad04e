#include <bake/ray_ends.h>

#include <bake/sparse_light.h>
#include <format/byte_stream.h>

#include <algorithm>
#include <bit>
#include <cstring>

namespace dimmer::cook {
namespace {

constexpr uint32_t word_bits = 32;

// The words that so many numbers take, and one more, so that reading two at a time stays inside.
size_t wordsFor(size_t count, uint32_t bits) {
    return (count * bits + word_bits - 1) / word_bits + 1;
}

}  // namespace

RayEnds::RayEnds(size_t rows, uint32_t receivers)
    : rows_(rows),
      receivers_(receivers),
      bits_(static_cast<uint32_t>(std::bit_width(receivers + RayEnd::kinds - 1))),
      blocks_(blockCount(rows)) {}

void RayEnds::get(size_t row, std::vector<uint32_t>& out) const {
    out.clear();
    const Block& block = blocks_[row / rows_per_block];
    if (block.first.empty()) return;
    const uint32_t first = block.first[row % rows_per_block], last = block.first[row % rows_per_block + 1];
    out.resize(last - first);
    const uint64_t mask = (uint64_t{1} << bits_) - 1;
    uint64_t bit = uint64_t{first} * bits_;
    for (uint32_t& value : out) {
        uint64_t pair;
        std::memcpy(&pair, &block.words[bit / word_bits], sizeof pair);
        value = end(static_cast<uint32_t>(pair >> (bit % word_bits) & mask));
        bit += bits_;
    }
}

void RayEnds::putBlock(size_t b, std::span<const std::vector<uint32_t>> rows) {
    Block& block = blocks_[b];
    block.first = {0};
    for (const auto& row : rows) block.first.push_back(block.first.back() + static_cast<uint32_t>(row.size()));
    block.words.assign(wordsFor(block.first.back(), bits_), 0);
    uint64_t bit = 0;
    for (const auto& row : rows)
        for (const uint32_t value : row) {
            uint64_t pair;
            std::memcpy(&pair, &block.words[bit / word_bits], sizeof pair);
            pair |= uint64_t{code(value)} << (bit % word_bits);
            std::memcpy(&block.words[bit / word_bits], &pair, sizeof pair);
            bit += bits_;
        }
}

std::vector<std::byte> RayEnds::toBytes() const {
    format::ByteWriter out;
    for (const Block& block : blocks_) {
        out.putArray(std::span<const uint32_t>(block.first));
        out.putArray(std::span<const uint32_t>(block.words));
    }
    return out.take();
}

std::optional<RayEnds> RayEnds::fromBytes(std::span<const std::byte> bytes, size_t rows, uint32_t receivers) {
    format::ByteReader in(bytes);
    RayEnds ends(rows, receivers);
    for (size_t b = 0; b < ends.blocks_.size(); ++b) {
        Block& block = ends.blocks_[b];
        block.first = in.getArray<uint32_t>();
        block.words = in.getArray<uint32_t>();
        if (block.first.empty() && block.words.empty()) continue;
        const size_t in_block = std::min(rows - b * rows_per_block, rows_per_block);
        if (!in.ok() || block.first.size() != in_block + 1 || block.first[0] != 0 ||
            !std::ranges::is_sorted(block.first) || block.words.size() != wordsFor(block.first.back(), ends.bits_))
            return {};
    }
    return in.atEnd() ? std::optional(std::move(ends)) : std::nullopt;
}

}  // namespace dimmer::cook
