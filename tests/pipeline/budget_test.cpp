// What a pack costs, and what happens when that is too much.
#include <gmock/gmock.h>
#include <pack/sample_pack.h>
#include <pipeline/budget.h>
#include <pipeline/small_level.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace dimmer::cook::test {
namespace {

using dimmer::test::samplePack;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(Budget, CostsAreSums) {
    const PackData data = samplePack();
    const PackCost cost = costOf(data);
    EXPECT_EQ(cost.base_lightmap, 2u * 32 * 32 * 8);
    // Every stored record, and the base of every receiver, 8 bytes each.
    uint64_t records = 0, receivers = 0;
    for (const Cluster& c : data.clusters) {
        records += uint64_t{c.receiver_count} * c.term_count;
        receivers += c.receiver_count;
    }
    EXPECT_EQ(cost.dynamic, 8 * (records + receivers));
    EXPECT_GE(cost.ancillary, receivers);  // a byte each says where it is
    EXPECT_EQ(cost.device(), cost.base_lightmap + cost.dynamic + cost.global_grid + cost.local_grids + cost.ancillary);
    EXPECT_EQ(cost.local_grids, 28 * (data.probes.base.size() - data.probes.global.positions.size()));
    // Two squares with lightmaps, two meshes of models.
    EXPECT_EQ(cost.meshes, 2u * (4 * 32 + 6 * 4) + 2u * (5 * 20 + 9 * 4));
}

TEST(Budget, AnElementHoldsEveryContributionThatNamesIt) {
    PackData data = samplePack();
    // Four probes that the first two contributions light, and two that the last one does.
    const auto last = static_cast<uint32_t>(data.contributions.size() - 1);
    ASSERT_GE(last, 2u);
    data.probes.clusters = {{0, 4, 0, 1, 0, 2}, {4, 2, 1, 1, 2, 1}};
    data.probes.terms = {{0, 0}, {1, 4}, {last, 8}};
    data.probes.record_counts.assign(data.contributions.size(), 0);
    data.probes.record_counts[0] = data.probes.record_counts[1] = 4;
    data.probes.record_counts[last] = 2;
    const PackCost cost = costOf(data);
    ASSERT_EQ(cost.elements.size(), data.elements.size());
    uint64_t all_probes = 0;
    for (uint32_t e = 0; e < data.elements.size(); ++e) {
        const auto count = [&](std::span<const Cluster> clusters, std::span<const ClusterTerm> terms) {
            uint64_t receivers = 0;
            for (const Cluster& cluster : clusters)
                for (uint32_t t = 0; t < cluster.term_count; ++t) {
                    const Contribution& c = data.contributions[terms[cluster.first_term + t].contribution];
                    std::vector<uint32_t> names = c.doors_open;
                    names.insert(names.end(), c.doors_closed.begin(), c.doors_closed.end());
                    if (c.light_set) names.push_back(*c.light_set);
                    if (std::ranges::find(names, e) != names.end()) receivers += cluster.receiver_count;
                }
            return receivers;
        };
        const uint64_t texels = count(data.clusters, data.terms),
                       probes = count(data.probes.clusters, data.probes.terms);
        all_probes += probes;
        EXPECT_EQ(cost.elements[e].element, e);
        EXPECT_EQ(cost.elements[e].receivers, texels);
        EXPECT_EQ(cost.elements[e].bytes, 8 * texels + 28 * probes);
        EXPECT_EQ(cost.elements[e].probe_bytes, 28 * probes);
    }
    EXPECT_GT(all_probes, 0u);
}

TEST(Budget, OverlapHistogramCountsEveryTexel) {
    const PackData data = samplePack();
    const auto histogram = costOf(data).overlap_histogram;
    std::vector<uint64_t> expected(histogram.size());
    std::vector<uint32_t> overlap(data.base_pages.size());
    for (const Cluster& c : data.clusters)
        for (uint32_t i = 0; i < c.receiver_count; ++i) {
            const uint32_t a = data.addresses[c.first_receiver + i];
            overlap[(TexelAddress::page(a) * 32 + TexelAddress::y(a)) * 32 + TexelAddress::x(a)] = c.term_count;
        }
    for (uint32_t n : overlap) {
        ASSERT_LT(n, expected.size());
        ++expected[n];
    }
    EXPECT_EQ(histogram, expected);
}

TEST(Budget, EachIsCheckedToTheByte) {
    const PackData data = samplePack();
    const PackCost cost = costOf(data);
    const auto& largest = *std::ranges::max_element(cost.elements, {}, &ElementCost::bytes);
    const std::string largest_name = data.elements[largest.element].name;
    struct Case {
        uint64_t Profile::*budget;
        uint64_t bytes;
        std::string name;
    };
    for (const Case& c : {Case{&Profile::budget_total, cost.device(), "total: "},
                          {&Profile::budget_base_lightmaps, cost.base_lightmap, "base lightmaps: "},
                          {&Profile::budget_dynamic, cost.dynamic, "dynamic records: "},
                          {&Profile::budget_per_element, largest.bytes, "'" + largest_name + "': "}}) {
        Profile profile;
        EXPECT_TRUE(checkBudgets(data, cost, profile)) << "0 is no limit";
        profile.*c.budget = c.bytes;
        EXPECT_TRUE(checkBudgets(data, cost, profile)) << c.name;
        profile.*c.budget = c.bytes - 1;
        const auto over = checkBudgets(data, cost, profile);
        ASSERT_FALSE(over.has_value()) << c.name;
        EXPECT_EQ(over.error().code, ErrorCode::OverBudget);
        EXPECT_THAT(over.error().message, HasSubstr(c.name));
        EXPECT_THAT(over.error().message, HasSubstr("largest"));
        // Who holds the most of what is too much: no set has texels of the pages.
        if (c.budget == &Profile::budget_base_lightmaps)
            EXPECT_THAT(over.error().message, AllOf(HasSubstr("of the charts"), Not(HasSubstr(largest_name))));
        else
            EXPECT_THAT(over.error().message, HasSubstr("'" + largest_name + "' "));
    }
}

TEST(Budget, AllThatIsOverIsNamed) {
    const PackData data = samplePack();
    Profile profile;
    profile.budget_total = profile.budget_dynamic = 1;
    const auto over = checkBudgets(data, costOf(data), profile);
    ASSERT_FALSE(over.has_value());
    EXPECT_THAT(over.error().message, HasSubstr("total: "));
    EXPECT_THAT(over.error().message, HasSubstr("dynamic records: "));
    EXPECT_THAT(over.error().message, Not(HasSubstr("base lightmaps: ")));
}

TEST(Budget, OverBudgetNothingIsWritten) {
    const TemporaryFolder folder;
    const auto level = writeLevel(folder, twoCells());
    const auto profile = writeText(folder, "tight.json", R"({"budgets": {"per_element": 1000, "dynamic": 2000},
        "bake": {"draft": {"samples_per_texel": 1, "series_rays": 4, "rays": 4, "emitter_samples": 1}}})");
    const auto pack = writeText(folder, "level.dimmer", "the old pack");
    SilentProgress silent;
    for (const auto& output : {pack, folder.path / "new.dimmer"}) {
        const auto result =
            cook({.level = level, .pack = output, .profile = profile.string(), .quality = "draft"}, silent);
        ASSERT_FALSE(result.has_value());
        EXPECT_EQ(result.error().code, ErrorCode::OverBudget);
        for (const char* part : {"over budget, nothing was written", "dynamic records: ", "'both'", "'one'", "'two'"})
            EXPECT_THAT(result.error().message, HasSubstr(part));
    }
    std::ifstream file(pack, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    EXPECT_EQ(text.str(), "the old pack");
    // The level, the profile and the old pack: no new pack, no temporary.
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path), {}), 3);
}

}  // namespace
}  // namespace dimmer::cook::test
