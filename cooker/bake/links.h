// Which receivers a level's rays lead from one to another: what a series follows, bounce after bounce.
#pragma once

#include <charts/unwrap.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace dimmer::cook {

// As many of each receiver, in as many bits as their number needs.
class Links {
   public:
    Links() = default;
    Links(size_t receivers, size_t of_each)
        : bits_(static_cast<uint32_t>(std::bit_width(receivers))),
          none_(static_cast<uint32_t>(receivers)),
          row_bytes_((of_each * bits_ + 7) / 8),
          bytes_(receivers * row_bytes_ + sizeof(uint64_t)) {}

    // `hits`: receivers, or no_index. Thread-safe for different receivers.
    void put(size_t receiver, std::span<const uint32_t> hits) {
        std::byte* to = &bytes_[receiver * row_bytes_];
        uint64_t waiting = 0;
        uint32_t count = 0;
        for (const uint32_t hit : hits) {
            waiting |= uint64_t{hit == no_index ? none_ : hit} << count;
            for (count += bits_; count >= 8; count -= 8, waiting >>= 8) *to++ = static_cast<std::byte>(waiting);
        }
        if (count > 0) *to = static_cast<std::byte>(waiting);
    }

    void get(size_t receiver, std::span<uint32_t> hits) const {
        const std::byte* const from = &bytes_[receiver * row_bytes_];
        const uint64_t mask = (uint64_t{1} << bits_) - 1;
        for (size_t i = 0; i < hits.size(); ++i) {
            uint64_t here;
            std::memcpy(&here, from + i * bits_ / 8, sizeof here);
            const auto hit = static_cast<uint32_t>(here >> (i * bits_ % 8) & mask);
            hits[i] = hit == none_ ? no_index : hit;
        }
    }

   private:
    uint32_t bits_ = 0, none_ = 0;
    size_t row_bytes_ = 0;
    std::vector<std::byte> bytes_;  // and eight more, as they are read eight at a time
};

}  // namespace dimmer::cook
