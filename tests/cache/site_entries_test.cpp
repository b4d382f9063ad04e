// Light at places where probes may stand, as a cook keeps it.
#include <cache/entries.h>
#include <gtest/gtest.h>
#include <pipeline/cook_cache.h>
#include <scene/level_file.h>

namespace dimmer::cook::test {
namespace {

Sparse<ProbeTermLight> lightOf(float value) {
    return Sparse<ProbeTermLight>::build(1, [&](size_t, size_t, auto emit) {
        ProbeTermLight light{};
        light.light.radiance[0] = glm::vec3(value);
        emit(std::span<const ProbeTermLight>(&light, 1));
    });
}

// A block of its own for each lamp of a large level, two of them with no place in the open.
TEST(SiteEntries, AreFewAndComeBackBlockByBlock) {
    const TemporaryFolder folder;
    CookCache cache(*CacheStore::open(folder.path), folder.path / "level.dimmer");
    const Key group = KeyBuilder("group").finish();
    std::vector<SiteBlock> blocks(70);
    std::vector<Sparse<ProbeTermLight>> light(blocks.size());
    std::vector<size_t> fresh;
    for (size_t b = 0; b < blocks.size(); ++b) {
        if (b == 7 || b == 69) continue;
        const auto number = static_cast<float>(b);
        blocks[b] = {{glm::vec3(number, 0, 1)}, 256};
        light[b] = lightOf(number);
        fresh.push_back(b);
    }
    EXPECT_TRUE(CookCache(*CacheStore::open(folder.path), "x").findSites("set", group, {}).empty());
    cache.keepSites(group, blocks, light, fresh);
    const auto files =
        std::distance(std::filesystem::directory_iterator(folder.path), std::filesystem::directory_iterator());
    EXPECT_GT(files, 10);
    EXPECT_LE(files, 32);
    const auto known = [&] {
        const auto found = cache.findSites("set", group, blocks);
        size_t count = 0;
        for (size_t b = 0; b < blocks.size(); ++b) {
            if (found[b].rows() == 0) continue;
            EXPECT_EQ(found[b].row(0)[0].light.radiance[0].x, static_cast<float>(b));
            ++count;
        }
        return count;
    };
    EXPECT_EQ(known(), 68u);
    EXPECT_TRUE(cache.lines().back().reused);
    blocks[40].places_m[0].y = 1;  // a lamp that moved: what shares an entry with it is made again, and no more
    EXPECT_LT(known(), 68u);
    EXPECT_GE(known(), 65u);
    EXPECT_FALSE(cache.lines().back().reused);
}

// A place in sight of very many doors.
TEST(SiteEntries, ARowMayBeLongerThan16BitsCount) {
    constexpr uint32_t terms = 70000;
    const std::array light{Sparse<ProbeTermLight>::build(2, [](size_t begin, size_t end, auto emit) {
        std::vector<ProbeTermLight> row(terms);
        for (uint32_t t = 0; t < terms; ++t) row[t].term = t;
        for (size_t i = begin; i < end; ++i) emit(std::span(row).first(i == 0 ? terms : 1));
    })};
    const auto found = siteLightFromBytes(toBytes(light), 1);
    ASSERT_TRUE(found);
    ASSERT_EQ(found->front().rows(), 2u);
    ASSERT_EQ(found->front().row(0).size(), terms);
    EXPECT_EQ(found->front().row(0).back().term, terms - 1);
    EXPECT_EQ(found->front().row(1).size(), 1u);
}

// Of whole bytes, and yet nothing that this build reads: a line must not say that it was used.
TEST(SiteEntries, WhatCannotBeReadWasNotFound) {
    const TemporaryFolder folder;
    const Key key = KeyBuilder("charts").finish();
    const std::array<std::byte, 3> nonsense{};
    ASSERT_TRUE(CacheStore::open(folder.path)->keep("charts", key, nonsense));
    CookCache cache(*CacheStore::open(folder.path), folder.path / "level.dimmer");
    EXPECT_FALSE(cache.findCharts(key));
    ASSERT_EQ(cache.lines().size(), 1u);
    EXPECT_FALSE(cache.lines()[0].reused);
    EXPECT_EQ(cache.lines()[0].why, "the entry is damaged");
}

}  // namespace
}  // namespace dimmer::cook::test
