// Where rays ended, for going there again: what a ray hits does not depend on which light is asked about.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// The end of one ray: the receiver that it reads, or one of these.
struct RayEnd {
    static constexpr uint32_t unknown = UINT32_MAX;      // not traced yet
    static constexpr uint32_t again = UINT32_MAX - 1;    // it met an emitter, say: to be traced each time
    static constexpr uint32_t sky = UINT32_MAX - 2;      // it met nothing
    static constexpr uint32_t nothing = UINT32_MAX - 3;  // it met what sends no light back
    static constexpr uint32_t through = UINT32_MAX - 4;  // it met leaves of doors: RowEnds::through has what it reads
    static constexpr uint32_t kinds = 4;                 // of known ends that are no receivers
};

// What a ray reads over one path (DoorPaths): a receiver, or RayEnd::sky.
struct PathEnd {
    uint32_t path = 0, end = 0;
    bool last = false;  // of its ray
    bool operator==(const PathEnd&) const = default;
};

// The ends of one row's rays, in their order.
struct RowEnds {
    uint32_t kept_max = UINT32_MAX;  // rays that are worth remembering, see RayEnds::keptMax()
    std::vector<uint32_t> ends;      // per ray
    std::vector<PathEnd> through;    // of all rays that are RayEnd::through, one after another
    size_t next = 0;                 // in `through`: of the next such ray

    void clear() {
        ends.clear();
        through.clear();
        next = 0;
    }
    // What the next ray that went through leaves reads. Empty: it is not known.
    std::span<const PathEnd> takeThrough() {
        const size_t begin = next;
        while (next < through.size() && !through[next++].last) continue;
        return std::span(through).subspan(begin, next - begin);
    }
};

// The ends of the first rays of each of many rows (receivers, or places), in as many bits as their numbers need.
class RayEnds {
   public:
    RayEnds() = default;
    // `receivers`: that rays may read; `paths`: over which.
    RayEnds(size_t rows, uint32_t receivers, uint32_t paths);

    // 0: nothing is remembered.
    size_t rows() const { return rows_; }
    // So many rays of each row are worth remembering for the final gather: of a large level fewer, or they would be
    // most of a cook's memory and push all else out of the cache.
    uint32_t keptMax() const;
    // Replaces `out`. Thread-safe.
    void get(size_t row, RowEnds& out) const;
    // Those of a block of rows (sparse_light.h) at once, none of them unknown; other blocks may be put at the same
    // time.
    void putBlock(size_t block, std::span<const RowEnds> rows);

    // For a store, part by part: all of them may be half a gigabyte, and nobody copies that as a whole. Both are
    // thread-safe for different parts.
    size_t parts() const { return (blocks_.size() + blocks_per_part - 1) / blocks_per_part; }
    std::vector<std::byte> toBytes(size_t part) const;
    // False, and nothing of the part is known, where they are not ends of so many rows.
    bool fromBytes(size_t part, std::span<const std::byte> bytes);

   private:
    static constexpr size_t blocks_per_part = 64;  // at most 40 MB

    // Numbers of `bits_` bits.
    struct Packed {
        std::vector<uint32_t> first;  // per row and one more
        std::vector<uint32_t> words;
    };
    // Ends; and of PathEnds two numbers each: the path and `last`, and the end.
    struct Block {
        Packed ends, through;
    };
    std::vector<uint32_t> packed(std::span<const uint32_t> numbers) const;
    void unpack(const Packed& packed, size_t row, std::vector<uint32_t>& out) const;
    bool areOf(const Packed& packed, size_t rows) const;
    std::span<const Block> blocksOf(size_t part) const {
        return std::span(blocks_).subspan(part * blocks_per_part,
                                          std::min(blocks_per_part, blocks_.size() - part * blocks_per_part));
    }
    uint32_t code(uint32_t end) const { return end < receivers_ ? end : receivers_ + (RayEnd::again - end); }
    // What is none of them is traced again.
    uint32_t end(uint32_t code) const {
        if (code < receivers_) return code;
        return code - receivers_ < RayEnd::kinds ? RayEnd::again - (code - receivers_) : RayEnd::again;
    }

    size_t rows_ = 0;
    uint32_t receivers_ = 0, paths_ = 0, bits_ = 0;
    std::vector<Block> blocks_;
};

// Of one level, for each of its receivers; filled in where they are empty.
struct RememberedRays {
    RayEnds links;   // of the series
    RayEnds gather;  // of the final gather, the first RayEnds::keptMax() of each receiver
};

// At some 18 bits each 2 kB a receiver and what those through leaves read, where single terms need so many; `preview`
// ends at 512. From 230,000 receivers on it is the bytes that end them.
inline constexpr uint32_t kept_rays_max = 1024;
inline constexpr size_t kept_bytes_max = size_t{512} << 20;

}  // namespace dimmer::cook
