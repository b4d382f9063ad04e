// Synthetic packs have the statistics that they promise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <synth/synth.h>
#include <write/pack_writer.h>

#include <cmath>
#include <map>

namespace dimmer::cook {
namespace {

PackData packLike(std::string_view level, double scale, uint32_t clusters, uint32_t sets = 0, uint32_t seed = 1) {
    auto pack = synthesise({.level = productionLevel(level).value(),
                            .scale = scale,
                            .clusters = clusters,
                            .light_sets = sets,
                            .seed = seed});
    if (!pack) throw std::runtime_error(pack.error().message);
    return std::move(*pack);
}

double meanOverlapOf(const PackData& pack) {
    return static_cast<double>(pack.payload.size()) / static_cast<double>(pack.base_pages.size());
}

// By hand from Table 1, in MiB: ESTATE (77 - 28) 2^20 / (8 * 2637824 + 28 * (50805 + 229725)) = 51380224 / 28957432.
TEST(Synth, MeanOverlapFollowsFromTable1) {
    EXPECT_NEAR(productionLevel("estate")->meanOverlap(), 1.7743, 1e-4);
    EXPECT_NEAR(productionLevel("yard")->meanOverlap(), 15.0 * 1048576 / 21464192, 1e-4);
    EXPECT_FALSE(productionLevel("house"));
}

TEST(Synth, EveryLevelHasItsElementsAndItsOverlapAndIsValid) {
    for (const LevelStatistics& level : productionLevels()) {
        const PackData pack = packLike(level.name, 1.0 / 16, 200);
        EXPECT_EQ(pack.elements.size(), level.light_sets + level.doors) << level.name;
        EXPECT_NEAR(meanOverlapOf(pack), level.meanOverlap(), 0.01 * level.meanOverlap()) << level.name;
        // Rows are whole: up to a row of 2048 more.
        EXPECT_NEAR(static_cast<double>(pack.base_pages.size()), level.texels / 16.0, 2048) << level.name;
        const auto valid = validate(pack);
        EXPECT_TRUE(valid) << level.name << ": " << valid.error().message;
    }
}

TEST(Synth, AtFullSizeTheTexelsAreExactlyTheTables) {
    const PackData pack = packLike("estate", 1, 100);
    EXPECT_EQ(pack.base_pages.size(), 2637824u);
    EXPECT_NEAR(meanOverlapOf(pack), 1.7743, 0.001 * 1.7743);
}

TEST(Synth, ClustersAreAsManyAsAskedAndScaleKeepsThem) {
    for (const double scale : {0.25, 0.5}) {
        const PackData pack = packLike("consulate", scale, 500);
        EXPECT_NEAR(static_cast<double>(pack.clusters.size()), 500, 5);  // cells of no texel vanish
    }
}

TEST(Synth, MoreSetsAtTheSameReceiversOnlySpreadTheRecords) {
    const PackData few = packLike("estate", 1.0 / 16, 300, 132), many = packLike("estate", 1.0 / 16, 300, 8 * 132);
    EXPECT_EQ(few.addresses, many.addresses);
    EXPECT_EQ(few.payload.size(), many.payload.size());
    EXPECT_EQ(many.elements.size(), 8u * 132);
}

// Receivers of a light set lie together: the mean distance between two of them is well below that of any two texels
// (about half the page's side for a square).
TEST(Synth, LightSetsAreRegions) {
    const PackData pack = packLike("estate", 1.0 / 4, 1000);
    std::map<uint32_t, std::vector<uint32_t>> of_set;
    for (const Cluster& c : pack.clusters)
        for (uint32_t t = c.first_term; t < c.first_term + c.term_count; ++t)
            of_set[pack.terms[t].contribution].push_back(pack.addresses[c.first_receiver]);
    const auto spread = [](const std::vector<uint32_t>& addresses) {
        double mean_x = 0, mean_x2 = 0;
        for (uint32_t a : addresses) {
            mean_x += TexelAddress::x(a);
            mean_x2 += std::pow(TexelAddress::x(a), 2);
        }
        const auto n = static_cast<double>(addresses.size());
        return std::sqrt(mean_x2 / n - std::pow(mean_x / n, 2));
    };
    double sum = 0;
    for (const auto& [set, addresses] : of_set) sum += spread(addresses);
    // Anywhere on 2048 columns it would be 2048 / sqrt(12) = 591.
    EXPECT_LT(sum / static_cast<double>(of_set.size()), 0.5 * 591);
}

TEST(Synth, TheSameSeedGivesTheSameBytes) {
    const auto bytes = [](uint32_t seed) { return packBytes(packLike("yard", 1.0 / 64, 50, 0, seed)); };
    EXPECT_EQ(bytes(3), bytes(3));
    EXPECT_NE(bytes(3), bytes(4));
}

TEST(Synth, RefusesWhatItCannotMake) {
    const auto level = *productionLevel("yard");
    EXPECT_FALSE(synthesise({.level = level, .scale = 0}));
    EXPECT_FALSE(synthesise({.level = level, .scale = std::nan("")}));
    EXPECT_FALSE(synthesise({.level = level, .clusters = 0}));
    EXPECT_FALSE(synthesise({.level = level, .light_sets = 5000}));
}

}  // namespace
}  // namespace dimmer::cook
