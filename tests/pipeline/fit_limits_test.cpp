// What `--fit` begins where budgets are far off, and what it says where it cannot end well.
#include <gmock/gmock.h>
#include <pipeline/fit.h>
#include <pipeline/small_level.h>

namespace dimmer::cook::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

PackData withGlobalProbes(size_t probes) {
    PackData pack;
    pack.probes.global.positions.resize(probes);
    return pack;
}

// One chart of 40 x 40 texels, and what fewer probes lose.
LossTable oneChart(bool fixed, std::vector<ProbesError> errors = {}) {
    Baked baked;
    baked.grid.errors = std::move(errors);
    return LossTable(baked, Texels{}, {}, 0, {.page_size = 64, .charts = {{40, 40}}, .fixed = {fixed}, .of_face = {}});
}

// 128 kB of 50, of which a grid of 28 kB can save only a part.
TEST(FitLimits, AGridWithABudgetOfItsOwnIsCutThoughTheTotalAsksForMore) {
    const PackData pack = withGlobalProbes(1000);
    PackCost cost;
    cost.base_lightmap = 100000;
    cost.global_grid = 28000;
    Profile profile;
    profile.budget_total = 50000;
    profile.budget_global_grid = 14000;
    const Remedy first = fittingRemedy(pack, cost, profile, {});
    ASSERT_EQ(first.changes.size(), 1u);
    EXPECT_EQ(first.changes[0].key, "grids.probes_max");
    EXPECT_NEAR(first.changes[0].to, 0.97 * 500 - 8, 1);  // half of them, a little less, but for the box's corners
    EXPECT_FALSE(first.fits);
    const auto named = remedies(pack, cost, profile, {});
    EXPECT_TRUE(std::ranges::any_of(named, [&](const Remedy& r) { return r.changes == first.changes; }));
    // And in the next round the total.
    cost.global_grid = 14000;
    const Remedy second = fittingRemedy(withGlobalProbes(500), cost, profile, {});
    EXPECT_TRUE(second.fits);
    EXPECT_EQ(second.changes.at(0).key, "lightmaps.texels_per_metre");
}

TEST(FitLimits, DensityIsLeftAloneWhereEverySurfaceHasItsOwn) {
    PackCost cost;
    cost.base_lightmap = 2000;
    Profile profile;
    profile.budget_base_lightmaps = 1000;
    EXPECT_TRUE(fittingRemedy({}, cost, profile, oneChart(true)).changes.empty());
    EXPECT_TRUE(remedies({}, cost, profile, oneChart(true)).empty());
    EXPECT_EQ(fittingRemedy({}, cost, profile, oneChart(false)).changes.size(), 1u);
}

// Texels 16 times as long are the coarsest that are taken: 1/256 of the bytes.
TEST(FitLimits, NothingIsBegunThatTheCoarsestPagesDoNotEnd) {
    PackCost cost;
    cost.base_lightmap = 256000;
    Profile profile;
    profile.budget_base_lightmaps = 999;
    EXPECT_TRUE(fittingRemedy({}, cost, profile, {}).changes.empty());
    // What would help without being enough is still named.
    const auto named = remedies({}, cost, profile, {});
    ASSERT_EQ(named.size(), 1u);
    EXPECT_FALSE(named[0].fits);
    profile.budget_base_lightmaps = 1000;
    EXPECT_EQ(fittingRemedy({}, cost, profile, {}).changes.size(), 1u);
    // A grid that is over would be cut in vain.
    profile.budget_base_lightmaps = 999;
    profile.budget_global_grid = 14000;
    cost.global_grid = 28000;
    EXPECT_TRUE(fittingRemedy(withGlobalProbes(1000), cost, profile, {}).changes.empty());
}

// Records, pages and the grid are all too large: thresholds or density alone would leave out what the grid needs, and a
// message names three ways.
TEST(FitLimits, WhatAGridNeedsIsNamedFirstWhereNothingIsEnough) {
    PackCost cost;
    cost.base_lightmap = 256000;
    cost.global_grid = 28000;
    Profile profile;
    profile.budget_base_lightmaps = 128000;
    const auto pages_alone = remedies(withGlobalProbes(1000), cost, profile, oneChart(false));
    ASSERT_FALSE(pages_alone.empty());
    EXPECT_EQ(pages_alone[0].changes.at(0).key, density_key);
    EXPECT_TRUE(pages_alone[0].fits);
    profile.budget_global_grid = 14000;
    const auto both = remedies(withGlobalProbes(1000), cost, profile, oneChart(false));
    ASSERT_GE(both.size(), 2u);
    EXPECT_EQ(both[0].changes.at(0).key, "grids.probes_max");
    EXPECT_FALSE(both[0].fits);
    EXPECT_EQ(both[1].changes.at(0).key, density_key);
}

// Fixed pages of 20 kB and a grid of 80: of 30 kB the grid's share would be 24, but 10 are left for it.
TEST(FitLimits, ProbesGiveAllWhereTexelsGiveNothing) {
    PackCost cost;
    cost.base_lightmap = 20000;
    cost.global_grid = 80000;
    Profile profile;
    profile.budget_total = 30000;
    const Remedy remedy = fittingRemedy(withGlobalProbes(1000), cost, profile, oneChart(true));
    ASSERT_EQ(remedy.changes.size(), 1u);
    EXPECT_EQ(remedy.changes[0].key, "grids.probes_max");
    EXPECT_NEAR(remedy.changes[0].to, 0.97 * 125 - 8, 1);
    EXPECT_TRUE(remedy.fits);
}

// The box's eight corners stay: where 1.5 kB of 110 would leave one or two probes of 104, one stays beside them, 0.9
// kB, and the coarsest pages, 0.4, fit beside that.
TEST(FitLimits, AsManyProbesGoAsCan) {
    PackCost cost;
    cost.base_lightmap = 100000;
    cost.global_grid = 10000;
    Profile profile;
    profile.budget_total = 1500;
    const Remedy remedy = fittingRemedy(withGlobalProbes(104), cost, profile, {});
    ASSERT_EQ(remedy.changes.size(), 2u);
    EXPECT_EQ(remedy.changes[0].key, "lightmaps.texels_per_metre");
    EXPECT_EQ(remedy.changes[1].key, "grids.probes_max");
    EXPECT_EQ(remedy.changes[1].to, 1);
    profile.budget_total = 1000;
    EXPECT_TRUE(fittingRemedy(withGlobalProbes(9), cost, profile, {}).changes.empty()) << "none can go";
}

// Records of probes go with them: 20 kB of fixed pages, 80 of grid and 100 of records make 60 kB with few enough
// probes.
TEST(FitLimits, RecordsOfProbesGoWithThem) {
    PackCost cost;
    cost.base_lightmap = 20000;
    cost.global_grid = 80000;
    cost.dynamic = cost.probe_records = 100000;
    Profile profile;
    profile.budget_total = 60000;
    const Remedy remedy = fittingRemedy(withGlobalProbes(1000), cost, profile, oneChart(true));
    ASSERT_FALSE(remedy.changes.empty());
    EXPECT_EQ(remedy.changes.back().key, "grids.probes_max");
    // Texels' records are no probes', with light or without.
    cost.probe_records = 0;
    EXPECT_TRUE(fittingRemedy(withGlobalProbes(1000), cost, profile, oneChart(true)).changes.empty());
}

// Nothing but probes has records: a budget of records asks for fewer of them.
TEST(FitLimits, RecordsOfProbesHaveABudgetToo) {
    PackCost cost;
    cost.base_lightmap = 20000;
    cost.global_grid = 80000;
    cost.dynamic = cost.probe_records = 100000;
    Profile profile;
    profile.budget_dynamic = 60000;
    const Remedy remedy = fittingRemedy(withGlobalProbes(1000), cost, profile, oneChart(true));
    ASSERT_EQ(remedy.changes.size(), 1u);
    EXPECT_EQ(remedy.changes[0].key, "grids.probes_max");
    EXPECT_NEAR(remedy.changes[0].to, 0.97 * 500 - 8, 1);  // the first share that does, of 3/4, 1/2, 3/8 ...
    EXPECT_TRUE(remedy.fits);
    const auto named = remedies(withGlobalProbes(1000), cost, profile, oneChart(true));
    ASSERT_FALSE(named.empty());
    EXPECT_EQ(named[0].changes, remedy.changes);
}

// Pages and the grid are too much in all. Where fewer probes lose nothing they go, as many as pages need not; where
// they lose more than pages do (which are all alike here, and lose nothing), none.
TEST(FitLimits, AsManyProbesGoAsLoseLeast) {
    PackCost cost;
    cost.base_lightmap = cost.global_grid = 50000;
    Profile profile;
    profile.budget_total = 70000;
    const Remedy dear =
        fittingRemedy(withGlobalProbes(1000), cost, profile, oneChart(false, {{100, 0.3f}, {1000, 0.1f}}));
    ASSERT_EQ(dear.changes.size(), 1u);
    EXPECT_EQ(dear.changes[0].key, density_key);
    // The same where pages cannot shrink: the first share that is enough, 3/8 of 50 kB with 50 of pages.
    const LossTable fixed = oneChart(true, {{100, 0.3f}, {1000, 0.1f}});
    const Remedy only = fittingRemedy(withGlobalProbes(1000), cost, profile, fixed);
    ASSERT_EQ(only.changes.size(), 1u);
    EXPECT_EQ(only.changes[0].key, "grids.probes_max");
    // 0.97 * 375 of 1000 probes, along the power that leads from 0.3 at 100 to 0.1 at 1000.
    ASSERT_TRUE(only.grid_error);
    EXPECT_NEAR(*only.grid_error, 0.1 * (std::pow(1000.0 / 363, std::log10(3.0)) - 1), 1e-6);
    EXPECT_THAT(only.text(), HasSubstr("adds 6.22 % to the light of models"));
}

TEST(FitLimits, WhatFewerProbesLoseIsReadOffWhatWasMeasured) {
    EXPECT_FALSE(oneChart(true).probesError(0.5));
    const LossTable table = oneChart(true, {{10, 0.4f}, {40, 0.2f}, {160, 0.1f}});
    EXPECT_EQ(table.probesError(1), 0.0);
    EXPECT_NEAR(*table.probesError(0.25), 0.1, 1e-7);                        // 40 probes
    EXPECT_NEAR(*table.probesError(0.125), 0.4 / std::sqrt(2) - 0.1, 1e-7);  // 20, between 10 and 40: as 1 / sqrt(n)
    EXPECT_NEAR(*table.probesError(10.0 / 160 / 8), 0.7, 1e-6);  // an eighth of the fewest: twice as far apart
}

// No grid of a model has less than 8 probes: one round finds that out, and its figures are not those of the settings
// that were asked for.
TEST(FitLimits, TheErrorTellsWhatHadBeenChanged) {
    const TemporaryFolder folder;
    LevelFile level = twoCells();
    const int crate = level.addNode({{"name", "crate"}, {"mesh", addRoomMesh(level, {0, 0, 0}, 1, addWhite(level))}});
    level.node(crate)["translation"] = {0.5, 0.5, 0.5};
    level.node(crate)["extras"] = {{"dimmer_lighting", "local_grid"}};
    const auto profile = writeText(folder, "tight.json", R"({"budgets": {"local_grids": 1}, "grids": {"global": "off"},
        "bake": {"draft": {"samples_per_texel": 1, "series_rays": 4, "rays": 4, "emitter_samples": 1}}})");
    CookOptions options{.level = writeLevel(folder, level),
                        .pack = folder.path / "level.dimmer",
                        .profile = profile.string(),
                        .quality = "draft"};
    options.fit = true;
    SilentProgress silent;
    const auto result = cook(options, silent);
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().code, ErrorCode::OverBudget);
    EXPECT_THAT(result.error().message, AllOf(HasSubstr("local grids: "), HasSubstr("--fit had changed"),
                                              testing::ContainsRegex("grids.local_probes_max [0-9]+ -> 8: saves")));
    EXPECT_FALSE(std::filesystem::exists(options.pack));
}

}  // namespace
}  // namespace dimmer::cook::test
