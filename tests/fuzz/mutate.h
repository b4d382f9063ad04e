// Damage to an input, by a seed: what files suffer, and what a fuzzer would try first.
#pragma once

#include <fuzz/target.h>

#include <algorithm>
#include <array>
#include <random>
#include <string>

namespace dimmer::fuzz {

inline constexpr std::array interesting_numbers = {"-1",  "0",    "1e999", "4294967295", "1e-300",
                                                   "nan", "1e9",  "0.5.",  "2147483648", "18446744073709551616",
                                                   "-0",  "1/2/3"};

inline void replaceNumber(Bytes& bytes, size_t at, std::string_view number) {
    const auto digit = [](uint8_t c) { return c >= '0' && c <= '9'; };
    const auto first = std::find_if(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end(), digit);
    const auto last = std::find_if_not(first, bytes.end(), digit);
    const auto place = bytes.erase(first, last);
    bytes.insert(place, number.begin(), number.end());
}

// One step of damage; `other` is an input to take pieces from.
inline void mutateOnce(Bytes& bytes, const Bytes& other, std::mt19937& random) {
    if (bytes.empty()) bytes.push_back(0);
    const size_t at = random() % bytes.size();
    const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const auto span = static_cast<std::ptrdiff_t>(std::min<size_t>(1 + random() % 16, bytes.size() - at));
    switch (random() % 8) {
        case 0:
            *place ^= static_cast<uint8_t>(1u << random() % 8);
            break;
        case 1:
            *place = static_cast<uint8_t>(random());
            break;
        case 2:
            bytes.erase(place, place + span);
            break;
        case 3:
            bytes.insert(place, 1 + random() % 8, static_cast<uint8_t>(random()));
            break;
        case 4: {
            const Bytes piece(place, place + span);
            bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(random() % bytes.size()), piece.begin(),
                         piece.end());
            break;
        }
        case 5: {
            const size_t from = other.empty() ? 0 : random() % other.size();
            const size_t count = std::min({other.size() - from, bytes.size() - at, size_t{1} + random() % 64});
            std::copy_n(other.begin() + static_cast<std::ptrdiff_t>(from), count, place);
            break;
        }
        case 6:
            // Four bytes of a count or an offset.
            for (size_t i = at & ~size_t{3}; i < std::min(bytes.size(), (at & ~size_t{3}) + 4); ++i)
                bytes[i] = random() % 2 ? 0xff : static_cast<uint8_t>(random() % 4);
            break;
        default:
            replaceNumber(bytes, at, interesting_numbers[random() % interesting_numbers.size()]);
    }
}

}  // namespace dimmer::fuzz
