// Clusters that join others: what that may cost, and what it must not change.
#include <cluster/merge.h>

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <random>

namespace dimmer::cook::test {
namespace {

std::vector<uint32_t> counting(uint32_t first, uint32_t count) {
    std::vector<uint32_t> list(count);
    std::iota(list.begin(), list.end(), first);
    return list;
}

// On the device: 8 bytes a record (in pairs; the base is one) and 16 a term of the largest work list.
size_t deviceBytes(const std::vector<Group>& groups) {
    size_t bytes = 0;
    for (const Group& g : groups)
        bytes += (g.items.size() + 1) / 2 * 2 * (g.contributions.size() + 1) * 8 + g.contributions.size() * 16;
    return bytes;
}

TEST(MergeGroups, AHandfulOfTexelsJoinsALongListBesideIt) {
    // One record of the 20th contribution at 2 texels (16 bytes) against 19 terms of a work list (304).
    const std::vector<uint64_t> one_tile(12, 7);
    const auto merged = mergeGroups({{counting(0, 20), 0, counting(0, 10)}, {counting(0, 19), 0, {10, 11}}}, one_tile,
                                    texel_group_bytes, 0);
    ASSERT_EQ(merged.size(), 1u);
    EXPECT_EQ(merged[0].contributions, counting(0, 20));
    EXPECT_EQ(merged[0].items, counting(0, 12));
}

TEST(MergeGroups, NeitherAcrossPagesNorFarAwayNorAboveTheLimitNorWhereItCostsMore) {
    const auto count = [](uint32_t page, uint64_t tile, uint32_t receivers, uint32_t first_contribution,
                          uint32_t contributions_max = 0) {
        std::vector<uint64_t> tiles(10 + receivers, 7);
        std::fill(tiles.begin() + 10, tiles.end(), tile);
        return mergeGroups({{counting(0, 20), 0, counting(0, 10)},
                            {counting(first_contribution, 19), page, counting(10, receivers)}},
                           tiles, texel_group_bytes, contributions_max)
            .size();
    };
    EXPECT_EQ(count(0, 7, 2, 1), 1u);
    EXPECT_EQ(count(1, 7, 2, 1), 2u);
    EXPECT_EQ(count(0, 8, 2, 1), 2u);
    EXPECT_EQ(count(0, 7, 36, 1), 1u);  // 36 more records, 288 bytes, against 19 terms, 304
    EXPECT_EQ(count(0, 7, 64, 1), 2u);  // 512 bytes
    EXPECT_EQ(count(0, 7, 2, 20), 2u);  // nothing in common
    EXPECT_EQ(count(0, 7, 2, 1, 20), 1u);
    EXPECT_EQ(count(0, 7, 2, 1, 19), 2u);  // the long list was there, but the limit is for joined ones
}

// Lists as they are where many lights end: each texel's differs from its neighbour's in a few places.
TEST(MergeGroups, NeverTakeMoreMemoryAndLoseNothing) {
    for (uint32_t seed = 0; seed < 20; ++seed) {
        std::mt19937 random(seed);
        std::map<std::vector<uint32_t>, std::vector<uint32_t>> lists;
        std::vector<uint64_t> tiles;
        std::vector<std::vector<uint32_t>> list_of;
        std::vector<uint32_t> list = counting(0, 15);
        for (uint32_t item = 0; item < 2000; ++item) {
            if (random() % 3 == 0) {
                const uint32_t k = random() % 40;
                if (const auto it = std::ranges::lower_bound(list, k); it == list.end() || *it != k)
                    list.insert(it, k);
                else if (list.size() > 1)
                    list.erase(it);
            }
            tiles.push_back(item / 64);
            lists[list].push_back(item);
            list_of.push_back(list);
        }
        std::vector<Group> groups;
        for (const auto& [contributions, items] : lists) groups.push_back({contributions, 0, items});
        const auto merged = mergeGroups(groups, tiles, texel_group_bytes, 0);
        EXPECT_LT(merged.size(), groups.size() / 2);
        EXPECT_LT(deviceBytes(merged), deviceBytes(groups));
        std::vector<uint32_t> seen;
        for (const Group& g : merged) {
            EXPECT_TRUE(std::ranges::is_sorted(g.items));
            for (const uint32_t item : g.items) {
                EXPECT_TRUE(std::ranges::includes(g.contributions, list_of[item]));
                seen.push_back(item);
            }
        }
        std::ranges::sort(seen);
        EXPECT_EQ(seen, counting(0, 2000));
    }
}

}  // namespace
}  // namespace dimmer::cook::test
