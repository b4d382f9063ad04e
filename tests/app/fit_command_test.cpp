// `cook --fit` says what it did to a level's light, and may be told how much of it is too much.
#include <app/tool_fixture.h>
#include <fmt/format.h>

namespace dimmer::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class FitCommand : public ToolTest {
   protected:
    static ProcessResult fit(const std::string& pack_name, std::vector<std::string> more = {}) {
        write("tight.json", R"({"extends": "quick.json", "budgets": {"dynamic": 15000}})");
        more.insert(more.end(), {"--fit", "--json", file("fit.json")});
        return cook(pack_name, more, "level.gltf", "tight.json");
    }
    static json figures() { return json::parse(readText(file("fit.json"))); }
    static double errorOf(const json& fitted) {
        double error = 0;
        for (const json& remedy : fitted) error += remedy["error"].get<double>();
        return error;
    }
};

// From the cache as well.
TEST_F(FitCommand, WarnsOfEachChange) {
    for (int i = 0; i < 2; ++i) {
        const auto result = fit("warned.dimmer");
        ASSERT_EQ(result.exit_code, 0) << result.err;
        const json said = figures(), fitted = said["fitted"];
        ASSERT_FALSE(fitted.empty());
        for (const json& remedy : fitted)
            for (const auto& [key, value] : remedy["changes"].items())
                EXPECT_THAT(result.err, testing::ContainsRegex(fmt::format(
                                            "dimmer: (warning: .*--fit changed settings: .*|    in full: .*){}", key)));
        size_t warnings = 0;
        for (const json& warning : said["warnings"])
            warnings += warning.get<std::string>().starts_with("over budget, --fit changed settings: ");
        EXPECT_EQ(warnings, fitted.size());
    }
}

TEST_F(FitCommand, WithinItsBudgetsWarnsOfNothing) {
    const auto result = cook("roomy.dimmer", {"--fit"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.err, testing::Not(HasSubstr("--fit")));
}

// The pack of a cook without the limit is in the cache by then, and is none of this cook's.
TEST_F(FitCommand, StopsAtTheErrorThatIsTooMuch) {
    ASSERT_EQ(fit("limited.dimmer").exit_code, 0);
    const std::string bytes = readText(file("limited.dimmer"));
    const double error = errorOf(figures()["fitted"]);
    ASSERT_GT(error, 0);
    const auto over = fit("limited.dimmer", {"--fit-max-error", fmt::format("{}", 0.9 * error)});
    EXPECT_EQ(over.exit_code, 3);
    EXPECT_THAT(over.err,
                AllOf(HasSubstr("over budget, nothing was written"),
                      HasSubstr(fmt::format("--fit would add a mean error of {:.2f} %, more than the {:.2f} % "
                                            "of --fit-max-error",
                                            100 * error, 90 * error))));
    EXPECT_EQ(figures()["result"], "over_budget");
    EXPECT_TRUE(readText(file("limited.dimmer")) == bytes);
    std::filesystem::remove(file("limited.dimmer"));
    EXPECT_EQ(fit("limited.dimmer", {"--fit-max-error", fmt::format("{}", 1.1 * error)}).exit_code, 0);
    EXPECT_TRUE(readText(file("limited.dimmer")) == bytes);
}

TEST_F(FitCommand, TheLimitIsAShareOfAFit) {
    for (const char* share : {"nan", "-0.1", "much"}) {
        const auto result = fit("never.dimmer", {"--fit-max-error", share});
        EXPECT_EQ(result.exit_code, 2) << share;
        EXPECT_THAT(result.err, HasSubstr("--fit-max-error"));
        EXPECT_LT(result.err.size(), 200u) << "ranges of doubles have 309 digits: " << result.err;
    }
    const auto result = cook("never.dimmer", {"--fit-max-error", "0.1"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, AllOf(HasSubstr("--fit-max-error"), HasSubstr("requires --fit")));
    EXPECT_FALSE(std::filesystem::exists(file("never.dimmer")));
}

}  // namespace
}  // namespace dimmer::test
