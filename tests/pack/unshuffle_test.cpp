#include <gtest/gtest.h>
#include <pack/unshuffle.h>

#include <random>
#include <vector>

namespace dimmer {
namespace {

std::vector<std::byte> randomBytes(size_t count) {
    std::mt19937 random(7);
    std::vector<std::byte> bytes(count);
    for (std::byte& b : bytes) b = std::byte(random() & 255);
    return bytes;
}

// What a pack holds of these records, byte by byte as docs/format.md says it.
std::vector<std::byte> shuffled(const std::vector<std::byte>& records, size_t record_bytes, bool differences) {
    std::vector<std::byte> out;
    const size_t count = records.size() / record_bytes;
    for (size_t b = 0; b < record_bytes; ++b)
        for (size_t i = 0; i < count; ++i) {
            const auto here = std::to_integer<int>(records[i * record_bytes + b]);
            const auto before = differences && i > 0 ? std::to_integer<int>(records[(i - 1) * record_bytes + b]) : 0;
            out.push_back(static_cast<std::byte>((here - before) & 255));
        }
    return out;
}

TEST(Unshuffle, GivesBackRecordsOfAnySize) {
    for (const bool differences : {false, true})
        for (size_t record_bytes = 1; record_bytes <= 33; ++record_bytes)
            for (const size_t count : {1, 2, 37}) {
                const auto records = randomBytes(record_bytes * count);
                std::vector<std::byte> out(records.size());
                unshuffle(shuffled(records, record_bytes, differences), record_bytes, differences, out);
                EXPECT_EQ(out, records) << count << " records of " << record_bytes << " bytes";
            }
}

TEST(Unshuffle, OfNothingTakesNoTimeWhateverARecordIs) {
    unshuffle({}, SIZE_MAX, true, {});
}

}  // namespace
}  // namespace dimmer
