#include <pack/unshuffle.h>

#include <cstdint>
#include <cstring>

namespace dimmer {
namespace {

// Sums of each byte of two words, modulo 256: the highest bits are kept out of the addition, so that no carry leaves
// its byte, and put in afterwards.
template <class Word>
Word sumOfBytes(Word a, Word b) {
    constexpr Word high = static_cast<Word>(0x8080808080808080u);
    constexpr Word low = static_cast<Word>(~high);
    return static_cast<Word>(((a & low) + (b & low)) ^ ((a ^ b) & high));
}

// As many bytes of each record as a word has, from `planes` on to `out` on.
template <class Word, bool differences>
void unshuffleWords(const std::byte* planes, size_t count, std::byte* out, size_t record_bytes) {
    Word before = 0;
    for (size_t i = 0; i < count; ++i) {
        Word word = 0;
        for (size_t b = 0; b < sizeof(Word); ++b)
            word = static_cast<Word>(word | std::to_integer<Word>(planes[b * count + i]) << (8 * b));
        if constexpr (differences) word = before = sumOfBytes(before, word);
        std::memcpy(out + i * record_bytes, &word, sizeof(Word));  // packs are little-endian, as this machine is
    }
}

template <bool differences>
void unshuffleRecords(const std::byte* shuffled, size_t count, std::byte* out, size_t record_bytes) {
    size_t b = 0;
    for (; record_bytes - b >= 8; b += 8)
        unshuffleWords<uint64_t, differences>(shuffled + b * count, count, out + b, record_bytes);
    for (; record_bytes - b >= 4; b += 4)
        unshuffleWords<uint32_t, differences>(shuffled + b * count, count, out + b, record_bytes);
    for (; b < record_bytes; ++b)
        unshuffleWords<uint8_t, differences>(shuffled + b * count, count, out + b, record_bytes);
}

}  // namespace

void unshuffle(std::span<const std::byte> shuffled, size_t record_bytes, bool differences, std::span<std::byte> out) {
    const size_t count = shuffled.size() / record_bytes;
    if (count == 0) return;  // whatever a record claims to hold
    if (differences)
        unshuffleRecords<true>(shuffled.data(), count, out.data(), record_bytes);
    else
        unshuffleRecords<false>(shuffled.data(), count, out.data(), record_bytes);
}

}  // namespace dimmer
