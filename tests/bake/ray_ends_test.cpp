// Where rays ended comes back as it was put; what damaged bytes say is never a receiver that is not there.
#include <bake/ray_ends.h>
#include <bake/sampling.h>
#include <bake/sparse_light.h>
#include <gtest/gtest.h>

namespace dimmer::cook {
namespace {

constexpr uint32_t paths = 7;

std::vector<RowEnds> someEnds(size_t rows, uint32_t receivers) {
    std::vector<RowEnds> all(rows);
    for (uint32_t i = 0; i < rows; ++i)
        for (uint32_t k = 0; k < hash(i) % 70; ++k) {
            const uint32_t draw = hash(i, k) % (receivers + RayEnd::kinds);
            all[i].ends.push_back(draw < receivers ? draw : RayEnd::again - (draw - receivers));
            if (all[i].ends.back() != RayEnd::through) continue;
            const uint32_t count = 1 + hash(i, k + 100) % 3;
            for (uint32_t n = 0; n < count; ++n)
                all[i].through.push_back({hash(i, n) % paths,
                                          hash(k, n) % 5 == 0 ? RayEnd::sky : hash(hash(i, k), n) % receivers,
                                          n + 1 == count});
        }
    return all;
}

RayEnds ends(const std::vector<RowEnds>& rows, uint32_t receivers) {
    RayEnds out(rows.size(), receivers, paths);
    for (size_t b = 0; b < blockCount(rows.size()); ++b) {
        const size_t begin = b * rows_per_block;
        out.putBlock(b, std::span(rows).subspan(begin, std::min(rows_per_block, rows.size() - begin)));
    }
    return out;
}

std::optional<RayEnds> read(std::span<const std::byte> bytes, size_t rows, uint32_t receivers) {
    RayEnds found(rows, receivers, paths);
    return found.parts() == 1 && found.fromBytes(0, bytes) ? std::optional(std::move(found)) : std::nullopt;
}

TEST(RayEnds, ComeBackAsTheyWere) {
    for (const uint32_t receivers : {1u, 5u, 1000u, 65533u, 65534u, 1u << 24}) {
        const auto rows = someEnds(600, receivers);
        const RayEnds put = ends(rows, receivers);
        const auto read = cook::read(put.toBytes(0), rows.size(), receivers);
        ASSERT_TRUE(read.has_value());
        RowEnds row;
        for (size_t i = 0; i < rows.size(); ++i)
            for (const RayEnds* from : {&put, &*read}) {
                from->get(i, row);
                EXPECT_EQ(row.ends, rows[i].ends);
                EXPECT_EQ(row.through, rows[i].through);
            }
    }
}

TEST(RayEnds, ArePackedTightly) {
    const uint32_t receivers = 65000;  // 16 bits
    const auto rows = someEnds(2560, receivers);
    size_t count = 0;
    for (const auto& row : rows) count += row.ends.size() + 2 * row.through.size();
    // Two bytes each, twice four to say where a row begins, and some 32 for each block of 256 rows.
    EXPECT_LE(ends(rows, receivers).toBytes(0).size(), 2 * count + 8 * rows.size() + 32 * 10 + 128);
}

TEST(RayEnds, OfAnotherLevelAreRefused) {
    const auto bytes = ends(someEnds(600, 1000), 1000).toBytes(0);
    EXPECT_FALSE(read(bytes, 900, 1000).has_value());
    EXPECT_FALSE(read(bytes, 300, 1000).has_value());
    EXPECT_FALSE(read(bytes, 600, 70000).has_value());  // of more bits
    EXPECT_FALSE(read(std::span(bytes).first(bytes.size() - 5), 600, 1000).has_value());
}

TEST(RayEnds, OfManyRowsComeBackPartByPart) {
    const uint32_t receivers = 1000;
    const auto rows = someEnds(40'000, receivers);
    const RayEnds put = ends(rows, receivers);
    RayEnds found(rows.size(), receivers, paths);
    ASSERT_GT(put.parts(), 2u);
    EXPECT_FALSE(found.fromBytes(put.parts() - 1, put.toBytes(0)));
    for (size_t part = put.parts(); part-- > 0;) ASSERT_TRUE(found.fromBytes(part, put.toBytes(part)));
    RowEnds row;
    for (size_t i = 0; i < rows.size(); ++i) {
        found.get(i, row);
        ASSERT_EQ(row.ends, rows[i].ends) << i;
        ASSERT_EQ(row.through, rows[i].through) << i;
    }
}

TEST(RayEnds, OfDamagedBytesAreReceiversThatAreThere) {
    const uint32_t receivers = 1000;
    const auto bytes = ends(someEnds(600, receivers), receivers).toBytes(0);
    size_t readable = 0, strange = 0;
    for (uint32_t i = 0; i < 300; ++i) {
        auto damaged = bytes;
        for (uint32_t k = 0; k < 20; ++k)
            damaged[hash(i, 2 * k) % damaged.size()] = static_cast<std::byte>(hash(i, 2 * k + 1));
        const auto found = read(damaged, 600, receivers);
        if (!found) continue;
        ++readable;
        RowEnds row;
        for (size_t r = 0; r < 600; ++r) {
            found->get(r, row);
            for (const uint32_t end : row.ends) {
                strange += end >= receivers && end < RayEnd::through;
                if (end != RayEnd::through) continue;
                for (const PathEnd& p : row.takeThrough())
                    strange += p.path >= paths || (p.end >= receivers && p.end != RayEnd::sky);
            }
        }
    }
    EXPECT_GT(readable, 10u);
    EXPECT_EQ(strange, 0u);
}

TEST(RayEnds, OfLargeLevelsFewerAreKept) {
    EXPECT_EQ(RayEnds(100'000, 100'000, paths).keptMax(), kept_rays_max);
    // 21 bits for each of 1.08 million receivers: 2^32 / (21 * 1.08 million).
    EXPECT_EQ(RayEnds(1'080'000, 1'080'000, paths).keptMax(), 189u);
}

}  // namespace
}  // namespace dimmer::cook
