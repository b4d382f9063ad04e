// How far `--fit` lowers the density: records need room to spare, pages go in steps and need none.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <pipeline/fit.h>
#include <pipeline/small_level.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

float densityOf(const Remedy& remedy) {
    EXPECT_EQ(remedy.changes.size(), 1u);
    if (remedy.changes.empty()) return 0;
    EXPECT_EQ(remedy.changes[0].key, "lightmaps.texels_per_metre");
    return remedy.changes[0].to;
}

float fittedDensity(const PackCost& cost, const Profile& profile, const LossTable& losses, size_t steps = 0) {
    const Remedy remedy = fittingRemedy({}, cost, profile, losses, steps);
    EXPECT_TRUE(remedy.fits);
    return densityOf(remedy);
}

Profile eightPerMetre() {
    Profile profile;
    profile.texels_per_metre = 8;
    return profile;
}

// Twice the budget: half the texels are left, of those with records 0.92 of half; or, where steps before fell short, a
// power of that half that grows by a half with each but the first.
TEST(DensityBudget, GoesFurtherWhereAStepFellShort) {
    PackCost pages, records;
    pages.base_lightmap = 2000;
    records.dynamic = 200000;
    Profile of_pages = eightPerMetre(), of_records = eightPerMetre();
    of_pages.budget_base_lightmaps = 1000;
    of_records.budget_dynamic = 100000;
    for (const auto& [steps, power] : {std::pair<size_t, double>{0, 1}, {1, 1}, {2, 1.5}, {4, 2.5}}) {
        const double share = std::pow(0.5, power);  // whole hundredths, rounded down
        EXPECT_NEAR(fittedDensity(pages, of_pages, {}, steps), 8 * std::sqrt(share), 0.0201);
        EXPECT_NEAR(fittedDensity(records, of_records, {}, steps), 8 * std::sqrt(0.92 * share), 0.0101);
    }
}

// One of 40 x 40 texels.
LossTable oneSquareChart() {
    return LossTable(Baked{}, Texels{}, {}, 0,
                     {.page_size = 64, .charts = {{40, 40}}, .fixed = {false}, .of_face = {}});
}

// A chart of 38 x 38 texels and one of padding around it, on pages whose height goes in steps of 8: 24 rows hold it
// with 22 texels to a side, 8 with 6, and there are no fewer.
TEST(DensityBudget, PagesMayTakeAllOfIt) {
    PackCost cost;
    cost.base_lightmap = 40 * 64 * 16;
    for (const auto& [rows, texels] : {std::pair{24, 22.0}, {8, 6.0}})
        for (const int more : {0, 1}) {
            Profile base = eightPerMetre(), total = eightPerMetre();
            base.budget_base_lightmaps = total.budget_total = static_cast<uint64_t>(rows * 64 * 16 + more);
            EXPECT_NEAR(fittedDensity(cost, base, oneSquareChart()), 8 * texels / 38, 0.0201) << rows;
            EXPECT_NEAR(fittedDensity(cost, total, oneSquareChart()), 8 * texels / 38, 0.0201) << rows;
        }
}

// The same chart, with records of 100 bytes a texel. Pages of 8 rows are the smallest, and the longest texels that are
// tried leave 3 x 3 and the padding: 2,500 bytes of records. Where 2,600 are left for them, that is too much for the
// room that they should have to spare, and fits.
TEST(DensityBudget, WhereNothingHasRoomToSpareIsWhatFits) {
    PackCost cost;
    cost.base_lightmap = 40 * 64 * 16;
    cost.dynamic = 40 * 40 * 100;
    Profile profile = eightPerMetre();
    profile.budget_total = 8 * 64 * 16 + 2600;
    EXPECT_NEAR(fittedDensity(cost, profile, oneSquareChart()), 8 * 3 / 38.0, 0.0201);
}

// What a density reaches when it is cooked by hand, a fit that may take as much reaches, too.
TEST(DensityBudget, IsMetByTheDensityThatTakesAllOfIt) {
    const TemporaryFolder folder;
    const auto level = writeLevel(folder, twoCells());
    const auto profile = writeText(folder, "quick.json", R"({"grids": {"global": "off"}, "bake": {"draft":
        {"samples_per_texel": 1, "series_rays": 4, "rays": 4, "emitter_samples": 1, "bounces": 2}}})");
    const auto run = [&](const std::string& set, bool fit) {
        CookOptions options{.level = level,
                            .pack = folder.path / "level.dimmer",
                            .profile = profile.string(),
                            .quality = "draft",
                            .set = {set}};
        options.fit = fit;
        SilentProgress silent;
        return cook(options, silent);
    };
    const auto whole = run("budgets.total=0", false);
    ASSERT_TRUE(whole) << whole.error().message;
    for (const float density : {2.0f, 1.0f, 0.5f}) {
        const auto by_hand = run(fmt::format("lightmaps.texels_per_metre={}", density), false);
        ASSERT_TRUE(by_hand) << by_hand.error().message;
        const uint64_t budget = costOf(by_hand->pack).base_lightmap;
        ASSERT_LT(budget, costOf(whole->pack).base_lightmap);
        const auto fitted = run(fmt::format("budgets.base_lightmaps={}", budget), true);
        ASSERT_TRUE(fitted) << fitted.error().message;
        EXPECT_LE(costOf(fitted->pack).base_lightmap, budget);
        EXPECT_GE(fitted->profile.texels_per_metre, density);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
