// `dimmer verify` as a gate of a pipeline.
#include <app/tool_fixture.h>

namespace dimmer::test {
namespace {

using testing::HasSubstr;

using VerifyCommand = ToolTest;

ProcessResult gate(const std::string& level, const std::string& pack, int paths, int seed, const char* max_error) {
    return runDimmer({"verify", level, pack, "--points", "20", "--no-sets", "--paths", std::to_string(paths), "--seed",
                      std::to_string(seed), "--max-error", max_error, "--json", "-"});
}

// A pack whose lamps have nine tenths of their light is a tenth too dark: with a reference of few paths, taking its
// noise off what is measured leaves anything down to nothing, and passed one time in a few.
TEST_F(VerifyCommand, NoiseLetsNothingPass) {
    auto dim = cook::test::twoCells();
    for (json& light : dim.document["extensions"]["KHR_lights_punctual"]["lights"])
        light["intensity"] = 0.9 * light["intensity"].get<double>();
    cook::test::TemporaryFolder folder;
    const std::string level = cook::test::writeLevel(folder, dim).string();
    const auto cooked =
        runDimmer({"cook", level, "-o", file("dim.dimmer"), "--profile", file("quick.json"), "--quality", "draft"});
    ASSERT_EQ(cooked.exit_code, 0) << cooked.err;
    int below = 0;  // by what is left without the noise
    for (const int paths : {2, 4, 8, 16})
        for (int seed = 1; seed <= 6; ++seed) {
            const auto result = gate(file("level.gltf"), file("dim.dimmer"), paths, seed, "0.05");
            EXPECT_EQ(result.exit_code, 4) << paths << " " << seed << " " << result.err;
            below += json::parse(result.out)["surface"]["mean"] <= 0.05;
        }
    EXPECT_GT(below, 0);
}

TEST_F(VerifyCommand, SaysWhereNoiseHidesTheError) {
    const auto hidden = gate(file("level.gltf"), pack(), 2, 1, "0.05");
    EXPECT_EQ(hidden.exit_code, 4);
    EXPECT_THAT(hidden.err, HasSubstr("hides whether the mean error is above 0.05: it takes some --paths "));
    // What is measured is within the limit with its noise.
    EXPECT_EQ(gate(file("level.gltf"), pack(), 2, 1, "100").exit_code, 0);
    // No number of paths is enough for nothing.
    EXPECT_THAT(gate(file("level.gltf"), pack(), 2, 1, "0").err, HasSubstr("is above 0"));
}

TEST_F(VerifyCommand, AVerdictThatFailsLeavesNoEarlierOne) {
    const auto verify = [](const char* state, const std::string& json_file) {
        return runDimmer({"verify", file("level.gltf"), pack(), "--points", "5", "--paths", "2", "--no-sets", "--state",
                          state, "--json", json_file});
    };
    const std::string verdict = file("verdict.json");
    ASSERT_EQ(verify("", verdict).exit_code, 0);
    const json written = json::parse(readText(verdict));
    EXPECT_EQ(written["level"], file("level.gltf"));
    EXPECT_EQ(written["seed"], 1);
    EXPECT_EQ(written["paths_per_point_max"], 2);
    EXPECT_EQ(verify("nothing=1", verdict).exit_code, 2);
    EXPECT_FALSE(std::filesystem::exists(verdict));
    // Of another kind: it stays.
    const std::string other = write("mine.json", R"({"surface": "mine"})");
    EXPECT_EQ(verify("nothing=1", other).exit_code, 2);
    EXPECT_EQ(readText(other), R"({"surface": "mine"})");
}

}  // namespace
}  // namespace dimmer::test
