#include <bake/links.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>

namespace dimmer::cook {
namespace {

// Of differences, how many bits to write as they are. One more adds a bit to each and spares two of those above that
// width: half of them are shorter, half of them longer. Reorders them.
uint32_t plainBits(std::span<uint32_t> differences) {
    const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
    std::ranges::nth_element(differences, middle);
    return static_cast<uint32_t>(std::bit_width(*middle | 1) - 1);
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
    // Of 1 to 2^31: its length, then what is behind its first bit (Elias 1975).
    void putNumber(uint32_t n) {
        const auto bits = static_cast<uint32_t>(std::bit_width(n) - 1);
        put((1u << bits) - 1, bits + 1);
        put(n & ((1u << bits) - 1), bits);
    }
    // Its lowest bits as they are, the others as a number.
    void putDifference(uint32_t difference, uint32_t plain_bits) {
        putNumber(1 + (difference >> plain_bits));
        put(difference & ((1u << plain_bits) - 1), plain_bits);
    }

   private:
    std::vector<uint8_t>& bytes_;
    uint64_t waiting_ = 0;
    uint32_t held_ = 0;
};

class BitReader {
   public:
    explicit BitReader(std::span<const uint8_t> bytes) : at_(bytes.data()), end_(at_ + bytes.size()) {}

    uint32_t get(uint32_t count) {
        fill();
        const auto value = static_cast<uint32_t>(bits_ & ((uint64_t{1} << count) - 1));
        skip(count);
        return value;
    }
    uint32_t number() {
        fill();
        const auto bits = static_cast<uint32_t>(std::countr_one(bits_));
        skip(bits + 1);
        return 1u << bits | get(bits);
    }
    uint32_t difference(uint32_t plain_bits) {
        const uint32_t above = number() - 1;
        return above << plain_bits | get(plain_bits);
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
        bits_ >>= count;
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
    std::vector<uint32_t> differences;
    {
        BitWriter writer(bytes);
        uint32_t path = 0;  // one more than the last
        for (size_t begin = 0, end = 0; begin < links.size(); begin = end) {
            while (end < links.size() && links[end].path == links[begin].path) ++end;
            const auto count = static_cast<uint32_t>(end - begin);
            writer.putNumber(1 + count);
            writer.putNumber(1 + links[begin].path - path);
            path = 1 + links[begin].path;
            differences.clear();
            for (size_t i = begin; i < end; ++i)
                differences.push_back(links[i].receiver - (i == begin ? 0 : links[i - 1].receiver));
            const uint32_t plain_bits = plainBits(differences);
            writer.putNumber(1 + plain_bits);
            for (uint32_t last = 0; begin < end; last = links[begin++].receiver)
                writer.putDifference(links[begin].receiver - last, plain_bits);
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
        const uint32_t plain_bits = reader.number() - 1;
        uint32_t at = 0;
        for (uint32_t i = 0; i < count; ++i) links.push_back({at += reader.difference(plain_bits), path});
        ++path;
    }
}

}  // namespace dimmer::cook
