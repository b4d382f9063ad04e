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

RayEnds::RayEnds(size_t rows, uint32_t receivers, uint32_t paths)
    : rows_(rows),
      receivers_(receivers),
      paths_(paths),
      bits_(static_cast<uint32_t>(std::bit_width(std::max(receivers + RayEnd::kinds, 2 * paths) - 1))),
      blocks_(blockCount(rows)) {}

uint32_t RayEnds::keptMax() const {
    const size_t bits_max = 8 * kept_bytes_max;
    return static_cast<uint32_t>(std::min<size_t>(kept_rays_max, bits_max / std::max<size_t>(1, rows_ * bits_)));
}

void RayEnds::get(size_t row, RowEnds& out) const {
    out.clear();
    const Block& block = blocks_[row / rows_per_block];
    unpack(block.ends, row % rows_per_block, out.ends);
    for (uint32_t& value : out.ends) value = end(value);
    thread_local std::vector<uint32_t> numbers;
    unpack(block.through, row % rows_per_block, numbers);
    for (size_t i = 0; i + 1 < numbers.size(); i += 2) {
        const PathEnd p{numbers[i] / 2, end(numbers[i + 1]), numbers[i] % 2 != 0};
        if (p.path >= paths_ || (p.end >= receivers_ && p.end != RayEnd::sky)) return out.through.clear();
        out.through.push_back(p);
    }
}

void RayEnds::putBlock(size_t b, std::span<const RowEnds> rows) {
    std::vector<uint32_t> ends, through;
    blocks_[b] = {{{0}, {}}, {{0}, {}}};
    for (const RowEnds& row : rows) {
        for (const uint32_t value : row.ends) ends.push_back(code(value));
        for (const PathEnd& p : row.through) {
            through.push_back(2 * p.path + p.last);
            through.push_back(code(p.end));
        }
        blocks_[b].ends.first.push_back(static_cast<uint32_t>(ends.size()));
        blocks_[b].through.first.push_back(static_cast<uint32_t>(through.size()));
    }
    blocks_[b].ends.words = packed(ends);
    blocks_[b].through.words = packed(through);
}

std::vector<uint32_t> RayEnds::packed(std::span<const uint32_t> numbers) const {
    std::vector<uint32_t> words(wordsFor(numbers.size(), bits_), 0);
    uint64_t bit = 0;
    for (const uint32_t number : numbers) {
        uint64_t pair;
        std::memcpy(&pair, &words[bit / word_bits], sizeof pair);
        pair |= uint64_t{number} << (bit % word_bits);
        std::memcpy(&words[bit / word_bits], &pair, sizeof pair);
        bit += bits_;
    }
    return words;
}

void RayEnds::unpack(const Packed& packed, size_t row, std::vector<uint32_t>& out) const {
    out.clear();
    if (packed.first.empty()) return;
    const uint32_t first = packed.first[row], last = packed.first[row + 1];
    out.resize(last - first);
    const uint64_t mask = (uint64_t{1} << bits_) - 1;
    uint64_t bit = uint64_t{first} * bits_;
    for (uint32_t& number : out) {
        uint64_t pair;
        std::memcpy(&pair, &packed.words[bit / word_bits], sizeof pair);
        number = static_cast<uint32_t>(pair >> (bit % word_bits) & mask);
        bit += bits_;
    }
}

std::vector<std::byte> RayEnds::toBytes(size_t part) const {
    format::ByteWriter out;
    for (const Block& block : blocksOf(part))
        for (const Packed* packed : {&block.ends, &block.through}) {
            out.putArray(std::span<const uint32_t>(packed->first));
            out.putArray(std::span<const uint32_t>(packed->words));
        }
    return out.take();
}

bool RayEnds::areOf(const Packed& packed, size_t rows) const {
    if (packed.first.empty()) return packed.words.empty();
    return packed.first.size() == rows + 1 && packed.first[0] == 0 && std::ranges::is_sorted(packed.first) &&
           packed.words.size() == wordsFor(packed.first.back(), bits_);
}

bool RayEnds::fromBytes(size_t part, std::span<const std::byte> bytes) {
    format::ByteReader in(bytes);
    std::vector<Block> blocks(blocksOf(part).size());
    const size_t first = part * blocks_per_part;
    for (size_t b = 0; b < blocks.size(); ++b)
        for (Packed* packed : {&blocks[b].ends, &blocks[b].through}) {
            packed->first = in.getArray<uint32_t>();
            packed->words = in.getArray<uint32_t>();
            const size_t rows_left = rows_ - (first + b) * rows_per_block;
            if (!in.ok() || !areOf(*packed, std::min(rows_left, rows_per_block))) return false;
        }
    if (!in.atEnd()) return false;
    std::ranges::move(blocks, blocks_.begin() + static_cast<std::ptrdiff_t>(first));
    return true;
}

}  // namespace dimmer::cook
