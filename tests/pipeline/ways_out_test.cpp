// What an error over a budget names, and that it does what is said of it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <pipeline/budget.h>
#include <pipeline/cook.h>
#include <pipeline/small_level.h>

namespace dimmer::cook::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct WaysOut : testing::Test {
    const TemporaryFolder folder;
    const std::filesystem::path level = writeLevel(folder, twoCells());

    Expected<CookResult> run(const std::string& budgets, bool fit, const std::vector<std::string>& set = {}) {
        const auto profile = writeText(folder, "mine.json", R"({"budgets": {)" + budgets + R"(},
            "grids": {"global": "on"}, "bake": {"draft": {"samples_per_texel": 1, "series_rays": 8, "rays": 32,
            "emitter_samples": 1, "bounces": 4, "probe_sites": 2, "probe_rays": 32}}})");
        SilentProgress silent;
        CookOptions options{.level = level,
                            .pack = folder.path / "level.dimmer",
                            .profile = profile.string(),
                            .quality = "draft",
                            .set = set};
        options.cache = folder.path / "cache";
        options.fit = fit;
        return cook(options, silent);
    }
    std::string messageOf(const std::string& budgets, bool fit = false) {
        const auto result = run(budgets, fit);
        EXPECT_FALSE(result);
        return result ? "" : result.error().message;
    }
};

// Pages and grid are each over a budget of their own: no single kind of setting mends both.
TEST_F(WaysOut, WhereNothingIsEnoughAreOneOfEachKindAndFit) {
    const auto whole = run("", false);
    ASSERT_TRUE(whole) << whole.error().message;
    const PackCost cost = costOf(whole->pack);
    const std::string budgets =
        fmt::format(R"("base_lightmaps": {}, "global_grid": {}, "dynamic": {})", cost.base_lightmap * 2 / 3,
                    cost.global_grid * 3 / 4, cost.dynamic * 9 / 10);
    const std::string message = messageOf(budgets);
    EXPECT_THAT(message,
                AllOf(HasSubstr("nothing is enough by itself"), HasSubstr("\n  lightmaps.texels_per_metre 4 -> "),
                      HasSubstr("\n  grids.probes_max 20000 -> "), HasSubstr("\n--fit tries these together")));
    EXPECT_TRUE(run(budgets, true)) << "as the message says";
}

TEST_F(WaysOut, WhereOneIsEnoughFitIsNotAsked) {
    const auto whole = run("", false);
    ASSERT_TRUE(whole) << whole.error().message;
    const std::string message =
        messageOf(fmt::format(R"("base_lightmaps": {})", costOf(whole->pack).base_lightmap * 2 / 3));
    EXPECT_THAT(message, AllOf(HasSubstr("; what would help:\n  lightmaps.texels_per_metre"), Not(HasSubstr("--fit"))));
}

// No grid is as small as this, but none is.
TEST_F(WaysOut, WhereTheGridAloneIsTooMuchItCanGo) {
    const std::string budgets = R"("global_grid": 1)";
    const std::string message = messageOf(budgets);
    EXPECT_THAT(message, AllOf(HasSubstr("none of the settings that were tried mends it"),
                               HasSubstr("\n  --set grids.global=off "), Not(HasSubstr("--fit"))));
    EXPECT_THAT(messageOf(budgets, true), HasSubstr("\n  --set grids.global=off "));
    EXPECT_TRUE(run(budgets, false, {"grids.global=off"})) << "as the message says";
}

}  // namespace
}  // namespace dimmer::cook::test
