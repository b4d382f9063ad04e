// What a cook said of a pack comes back with it.
#include <gmock/gmock.h>
#include <pipeline/cook_cache.h>
#include <scene/level_file.h>

namespace dimmer::cook::test {
namespace {

Key someKey() {
    return KeyBuilder("test").finish();
}

PackEntry keptAndFound(const PackEntry& entry) {
    const TemporaryFolder folder;
    const auto cacheOf = [&] { return CookCache(CacheStore::open(folder.path).value(), folder.path / "level.dimmer"); };
    cacheOf().keepPack(someKey(), entry);
    const auto found = cacheOf().findPack(someKey());
    EXPECT_TRUE(found);
    return found.value_or(PackEntry{});
}

void expectSame(const Remedy& a, const Remedy& b) {
    EXPECT_EQ(a.changes, b.changes);
    EXPECT_EQ(a.fits, b.fits);
    EXPECT_EQ(a.saves, b.saves);
    EXPECT_EQ(a.error, b.error);
    EXPECT_EQ(a.energy, b.energy);
    EXPECT_EQ(a.energy_of, b.energy_of);
    EXPECT_EQ(a.moves_light, b.moves_light);
    EXPECT_EQ(a.grid_error, b.grid_error);
    EXPECT_EQ(a.texels, b.texels);
}

// Each differs from what a remedy is without: what is not kept is missed. One of no error is not one of an unknown one.
TEST(PackEntry, OfAFitKeepsAllThatIsSaidOfIt) {
    const std::vector<Remedy> fitted = {{.changes = {{"grids.probes_max", 20000, 512}, {"records.threshold", 0.01f, 1}},
                                         .fits = true,
                                         .saves = uint64_t{5} << 32,
                                         .error = 0.0123,
                                         .energy = 0.25,
                                         .energy_of = "set 'hall'",
                                         .moves_light = true,
                                         .grid_error = 0.2321,
                                         .texels = false},
                                        {.changes = {}, .grid_error = 0.0},
                                        {}};
    PackEntry entry;
    entry.fitted = fitted;
    const PackEntry found = keptAndFound(entry);
    ASSERT_EQ(found.fitted.size(), fitted.size());
    for (size_t i = 0; i < fitted.size(); ++i) {
        expectSame(found.fitted[i], fitted[i]);
        EXPECT_EQ(found.fitted[i].text(), fitted[i].text());
    }
}

TEST(PackEntry, KeepsWarningsBouncesAndCombinations) {
    PackEntry entry;
    entry.pack.assign(100, std::byte{7});
    entry.bounces = 5;
    entry.warnings = {"one", ""};
    entry.suggested_combinations = {{"a", "b"}, {"c"}};
    const PackEntry found = keptAndFound(entry);
    EXPECT_EQ(found.pack, entry.pack);
    EXPECT_EQ(found.bounces, entry.bounces);
    EXPECT_EQ(found.warnings, entry.warnings);
    EXPECT_EQ(found.suggested_combinations, entry.suggested_combinations);
}

}  // namespace
}  // namespace dimmer::cook::test
