// Ctrl-C, sent to the tool itself.
#include <app/tool_fixture.h>
#include <dimmer/pack.h>

#include <csignal>
#include <set>

namespace dimmer::test {
namespace {

using Interrupt = ToolTest;

std::set<std::string> namesIn(const std::filesystem::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
}

TEST_F(Interrupt, ACookEndsAndLeavesTheOldPack) {
    // A million rays a texel: minutes.
    write("long.json", R"({"bake": {"draft": {"rays": 1000000}}})");
    write("kept.dimmer", "the old pack");
    const std::filesystem::path folder = std::filesystem::path(pack()).parent_path();
    const auto before = namesIn(folder);
    for (const auto& [signal, exit_code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}}) {
        const auto result = runInterrupted(DIMMER_TOOL,
                                           {"cook", file("level.gltf"), "-o", file("kept.dimmer"), "--profile",
                                            file("long.json"), "--quality", "draft"},
                                           signal, [](const std::string& err) { return err.contains("bounces"); });
        EXPECT_EQ(result.exit_code, exit_code);
        EXPECT_THAT(result.out, testing::IsEmpty());
        EXPECT_THAT(result.err, testing::EndsWith("dimmer: interrupted\n"));
        EXPECT_EQ(readText(file("kept.dimmer")), "the old pack");
        EXPECT_EQ(namesIn(folder), before);
    }
}

// The signal comes while the file is written: it is finished, whichever comes first then, the process's own end or the
// signal's.
TEST_F(Interrupt, AFileBeingReplacedIsFinishedFirst) {
    write("pages.dimmer", "the old pack");
    const std::filesystem::path folder = std::filesystem::path(pack()).parent_path();
    const auto before = namesIn(folder);
    const auto result =
        runInterrupted(DIMMER_TOOL, {"synth", "--like", "safehouse", "--scale", "0.5", "-o", file("pages.dimmer")},
                       SIGINT, [&](const std::string&) { return namesIn(folder) != before; });
    EXPECT_TRUE(result.exit_code == 130 || result.exit_code == 0) << result.exit_code;
    EXPECT_EQ(namesIn(folder), before);
    EXPECT_TRUE(Pack::open(file("pages.dimmer")).has_value());
}

}  // namespace
}  // namespace dimmer::test
