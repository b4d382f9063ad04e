#include <bake/links.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>

namespace dimmer::cook {
namespace {

// Of a difference, the bits that are written as they are: about the mean's.
uint32_t plainBits(uint32_t receivers, size_t links) {
    return static_cast<uint32_t>(std::bit_width(receivers / links | 1) - 1);
}

// The first bit written is the lowest of the first byte.
class BitWriter {
   public:
    explicit BitWriter(std::vector<uint8_t>& bytes) : bytes_(bytes) {}
    BitWriter(const BitWriter&) = delete;
    BitWriter& operator=(const BitWriter&) = delete;
    ~BitWriter() {
        if (held_ > 0) bytes_.push_back(static_cast<uint8_t>(waiting_));
    }

    void put(uint32_t value, uint32_t count) {
        waiting_ |= uint64_t{value} << held_;
        for (held_ += count; held_ >= 8; held_ -= 8, waiting_ >>= 8) bytes_.push_back(static_cast<uint8_t>(waiting_));
    }
    // So many ones and a zero, then the lowest bits of `low`.
    void putOnes(uint32_t ones, uint32_t low, uint32_t low_bits) {
        for (; ones >= 31; ones -= 31) put((1u << 31) - 1, 31);
        put((1u << ones) - 1, ones + 1);
        put(low & static_cast<uint32_t>((uint64_t{1} << low_bits) - 1), low_bits);
    }
    // Of 1 and above (Elias 1975).
    void putNumber(uint32_t n) {
        const auto bits = static_cast<uint32_t>(std::bit_width(n) - 1);
        putOnes(bits, n, bits);
    }

   private:
    std::vector<uint8_t>& bytes_;
    uint64_t waiting_ = 0;
    uint32_t held_ = 0;
};

class BitReader {
   public:
    explicit BitReader(std::span<const uint8_t> bytes) : at_(bytes.data()), end_(at_ + bytes.size()) {}

    // How many ones stand before the next zero, which is taken too.
    uint32_t ones() {
        uint32_t count = 0;
        for (fill(); held_ > 0; fill()) {
            const auto run = static_cast<uint32_t>(std::countr_one(bits_));
            count += std::min(run, held_);
            if (run < held_) {
                skip(run + 1);
                break;
            }
            skip(held_);
        }
        return count;
    }
    uint32_t get(uint32_t count) {
        fill();
        const auto value = static_cast<uint32_t>(bits_ & ((uint64_t{1} << count) - 1));
        skip(std::min(count, held_));
        return value;
    }
    uint32_t number() {
        const uint32_t bits = ones();
        return 1u << bits | get(bits);
    }
    // What putOnes() wrote, as one number.
    uint32_t difference(uint32_t low_bits) {
        const uint32_t high = ones();
        return high << low_bits | get(low_bits);
    }

   private:
    // At least 56 bits, or all that there are.
    void fill() {
        if (end_ - at_ >= 8) {
            uint64_t next;
            std::memcpy(&next, at_, sizeof next);
            bits_ |= next << held_;
            at_ += (63 - held_) / 8;
            held_ |= 56;
            return;
        }
        for (; held_ <= 56 && at_ != end_; held_ += 8) bits_ |= uint64_t{*at_++} << held_;
    }
    void skip(uint32_t count) {
        bits_ = count < 64 ? bits_ >> count : 0;
        held_ -= count;
    }

    const uint8_t *at_, *end_;
    uint64_t bits_ = 0;  // above what is held, some of what comes next or 0
    uint32_t held_ = 0;
};

}  // namespace

void Links::Builder::put(size_t receiver, std::vector<Link>& links) {
    std::ranges::sort(links, [](const Link& a, const Link& b) {
        return (uint64_t{a.path} << 32 | a.receiver) < (uint64_t{b.path} << 32 | b.receiver);
    });
    std::vector<uint8_t> bytes;
    {
        BitWriter writer(bytes);
        uint32_t path = 0;  // one more than the last
        for (size_t begin = 0, end = 0; begin < links.size(); begin = end) {
            while (end < links.size() && links[end].path == links[begin].path) ++end;
            const auto count = static_cast<uint32_t>(end - begin);
            writer.putNumber(1 + count);
            writer.putNumber(1 + links[begin].path - path);
            path = 1 + links[begin].path;
            const uint32_t low_bits = plainBits(receivers_, count);
            uint32_t last = 0;
            for (; begin < end; last = links[begin++].receiver) {
                const uint32_t difference = links[begin].receiver - last;
                writer.putOnes(difference >> low_bits, difference, low_bits);
            }
        }
        if (!links.empty()) writer.putNumber(1);
    }
    bytes_.put(receiver, bytes);
}

void Links::get(size_t receiver, std::vector<Link>& links) const {
    links.clear();
    const std::span<const uint8_t> bytes = bytes_.row(receiver);
    if (bytes.empty()) return;
    BitReader reader(bytes);
    uint32_t path = 0;
    while (const uint32_t count = reader.number() - 1) {
        path += reader.number() - 1;
        const uint32_t low_bits = plainBits(receivers_, count);
        uint32_t at = 0;
        for (uint32_t i = 0; i < count; ++i) links.push_back({at += reader.difference(low_bits), path});
        ++path;
    }
}

}  // namespace dimmer::cook
