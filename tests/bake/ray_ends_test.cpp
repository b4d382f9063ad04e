// Where rays ended comes back as it was put; what damaged bytes say is never a receiver that is not there.
#include <bake/ray_ends.h>
#include <bake/sampling.h>
#include <bake/sparse_light.h>
#include <gtest/gtest.h>

namespace dimmer::cook {
namespace {

std::vector<std::vector<uint32_t>> someEnds(size_t rows, uint32_t receivers) {
    std::vector<std::vector<uint32_t>> all(rows);
    for (uint32_t i = 0; i < rows; ++i)
        for (uint32_t k = 0; k < hash(i) % 70; ++k) {
            const uint32_t draw = hash(i, k) % (receivers + RayEnd::kinds);
            all[i].push_back(draw < receivers ? draw : RayEnd::again - (draw - receivers));
        }
    return all;
}

RayEnds ends(const std::vector<std::vector<uint32_t>>& rows, uint32_t receivers) {
    RayEnds out(rows.size(), receivers);
    for (size_t b = 0; b < blockCount(rows.size()); ++b) {
        const size_t begin = b * rows_per_block;
        out.putBlock(b, std::span(rows).subspan(begin, std::min(rows_per_block, rows.size() - begin)));
    }
    return out;
}

TEST(RayEnds, ComeBackAsTheyWere) {
    for (const uint32_t receivers : {1u, 5u, 1000u, 65533u, 65534u, 1u << 24}) {
        const auto rows = someEnds(600, receivers);
        const RayEnds put = ends(rows, receivers);
        const auto read = RayEnds::fromBytes(put.toBytes(), rows.size(), receivers);
        ASSERT_TRUE(read.has_value());
        std::vector<uint32_t> row;
        for (size_t i = 0; i < rows.size(); ++i) {
            put.get(i, row);
            EXPECT_EQ(row, rows[i]);
            read->get(i, row);
            EXPECT_EQ(row, rows[i]);
        }
    }
}

TEST(RayEnds, ArePackedTightly) {
    const uint32_t receivers = 65000;  // 16 bits
    const auto rows = someEnds(2560, receivers);
    size_t count = 0;
    for (const auto& row : rows) count += row.size();
    // Two bytes each, four to say where a row begins, and some 16 for each block of 256 rows.
    EXPECT_LE(ends(rows, receivers).toBytes().size(), 2 * count + 4 * rows.size() + 16 * 10 + 64);
}

TEST(RayEnds, OfAnotherLevelAreRefused) {
    const auto bytes = ends(someEnds(600, 1000), 1000).toBytes();
    EXPECT_FALSE(RayEnds::fromBytes(bytes, 900, 1000).has_value());
    EXPECT_FALSE(RayEnds::fromBytes(bytes, 300, 1000).has_value());
    EXPECT_FALSE(RayEnds::fromBytes(bytes, 600, 70000).has_value());  // of more bits
    EXPECT_FALSE(RayEnds::fromBytes(std::span(bytes).first(bytes.size() - 5), 600, 1000).has_value());
}

TEST(RayEnds, OfDamagedBytesAreReceiversThatAreThere) {
    const uint32_t receivers = 1000;
    const auto bytes = ends(someEnds(600, receivers), receivers).toBytes();
    size_t read = 0, strange = 0;
    for (uint32_t i = 0; i < 300; ++i) {
        auto damaged = bytes;
        for (uint32_t k = 0; k < 20; ++k)
            damaged[hash(i, 2 * k) % damaged.size()] = static_cast<std::byte>(hash(i, 2 * k + 1));
        const auto found = RayEnds::fromBytes(damaged, 600, receivers);
        if (!found) continue;
        ++read;
        std::vector<uint32_t> row;
        for (size_t r = 0; r < 600; ++r) {
            found->get(r, row);
            for (const uint32_t end : row) strange += end >= receivers && end < RayEnd::nothing;
        }
    }
    EXPECT_GT(read, 10u);
    EXPECT_EQ(strange, 0u);
}

}  // namespace
}  // namespace dimmer::cook
