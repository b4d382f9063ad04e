// `dimmer report` and `cook --report`.
#include <app/tool_fixture.h>

namespace dimmer::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

using ReportTool = ToolTest;

TEST_F(ReportTool, OfAPackWithWhatCookAndVerifySaid) {
    ASSERT_EQ(runDimmer({"verify", file("level.gltf"), pack(), "--points", "50", "--paths", "64", "--no-sets", "--json",
                         file("error.json"), "--heatmap", file("heat")})
                  .exit_code,
              0);
    const auto result = runDimmer({"report", pack(), "-o", file("report.html"), "--cook", file("cook.json"), "--verify",
                                   file("error.json"), "--heatmap", file("heat")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(
        readText(file("report.html")),
        AllOf(HasSubstr("level.dimmer"), HasSubstr("region of both"), HasSubstr("encode"), HasSubstr("Error against"),
              HasSubstr("error on page 0"), HasSubstr("All light sets on, doors closed")));
}

TEST_F(ReportTool, OfACook) {
    const auto result = cook("reported.dimmer", {"--report", file("cooked.html")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(readText(file("cooked.html")), AllOf(HasSubstr("reported.dimmer"), HasSubstr("region of one"),
                                                     HasSubstr(" s in all"), HasSubstr("of 268.44 MB")));
}

// Every line of stderr is an object, but for messages; a stage begins at 0, never goes back, and ends at its total.
TEST_F(ReportTool, ProgressForPipelines) {
    const auto result = cook("progress.dimmer", {"--progress", "json", "--no-cache"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::istringstream lines(result.err);
    std::vector<std::string> stages;
    json last;
    for (std::string text; std::getline(lines, text);) {
        if (text.starts_with("dimmer: ")) continue;
        const json line = json::parse(text, nullptr, false);
        ASSERT_TRUE(line.is_object()) << text;
        for (const char* key : {"stage", "done", "total", "seconds_left"}) ASSERT_TRUE(line.contains(key)) << text;
        EXPECT_LE(line["done"], line["total"]);
        if (stages.empty() || stages.back() != line["stage"]) {
            EXPECT_EQ(line["done"], 0);
            EXPECT_TRUE(stages.empty() || last["done"] == last["total"]) << last;
            stages.push_back(line["stage"]);
        } else {
            EXPECT_GE(line["done"], last["done"]);
        }
        last = line;
    }
    EXPECT_EQ(last["done"], last["total"]);
    EXPECT_EQ(last["seconds_left"], 0);
    EXPECT_THAT(stages, testing::IsSupersetOf({"charts", "encode"}));
    EXPECT_EQ(cook("no.dimmer", {"--progress", "xml"}).exit_code, 2);
}

TEST_F(ReportTool, WhatIsRefused) {
    const auto refused = [](const std::vector<std::string>& more, const std::string& message) {
        std::vector<std::string> arguments = {"report", pack(), "-o", file("no.html")};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const auto result = runDimmer(arguments);
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.err, HasSubstr(message));
        EXPECT_FALSE(std::filesystem::exists(file("no.html")));
    };
    write("broken.json", "{");
    refused({"--cook", file("none.json")}, "none.json");
    refused({"--cook", file("broken.json")}, "no JSON");
    for (const char* figures : {"--cook", "--verify"})
        refused({figures, std::filesystem::path(file("none.json")).parent_path().string()}, "cannot be opened");
    refused({"--cook", write("list.json", "[1]")}, "not what `dimmer cook --json` writes");
    refused({"--verify", file("broken.json")}, "no JSON");
    for (const char* other : {"[1]", "{}", "null", R"({"state": "", "converged": true, "surface": 1, "sets": []})"})
        refused({"--verify", write("other.json", other)}, "not what `dimmer verify --json` writes");
    refused({"--verify", file("cook.json")}, "not what `dimmer verify --json` writes");
    refused({"--heatmap", file("nowhere")}, "page_0.png");
    const auto second = cook("second.dimmer", {"--set", "records.threshold=0.2", "--json", file("second.json")});
    ASSERT_EQ(second.exit_code, 0) << second.err;
    refused({"--cook", file("second.json")}, "of another pack");
    // Pages of the same size, too.
    ASSERT_EQ(runDimmer({"verify", file("level.gltf"), file("second.dimmer"), "--points", "50", "--paths", "64",
                         "--no-sets", "--heatmap", file("second_heat")})
                  .exit_code,
              0);
    refused({"--heatmap", file("second_heat")}, "heat_maps.json: it is of another pack");
    // Of this pack, but pictures of one state and figures of another.
    const auto verify = [](const char* state, const char* option, const std::string& to) {
        return runDimmer({"verify", file("level.gltf"), pack(), "--points", "5", "--paths", "2", "--no-sets", "--state",
                          state, option, to});
    };
    ASSERT_EQ(verify("", "--json", file("all.json")).exit_code, 0);
    ASSERT_EQ(verify("one=0", "--heatmap", file("one_heat")).exit_code, 0);
    refused({"--verify", file("all.json"), "--heatmap", file("one_heat")},
            R"(heat_maps.json: its pictures are of the state "one=0", the figures of --verify of "")");
    // No pack came of a cook over its budgets, whatever it would have been named.
    ASSERT_EQ(cook("over.dimmer", {"--set", "budgets.total=1000", "--json", file("over.json")}).exit_code, 3);
    refused({"--cook", file("over.json")}, "over its budgets");
}

}  // namespace
}  // namespace dimmer::test
