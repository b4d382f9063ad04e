// `dimmer verify` and `dimmer stress` as gates of a pipeline.
#include <app/tool_fixture.h>

namespace dimmer::test {
namespace {

using testing::HasSubstr;

using VerifyCommand = ToolTest;
using StressCommand = ToolTest;

ProcessResult gate(const std::string& level, const std::string& pack, int paths, int seed, const char* max_error) {
    return runDimmer({"verify", level, pack, "--points", "20", "--no-sets", "--paths", std::to_string(paths), "--seed",
                      std::to_string(seed), "--max-error", max_error, "--json", "-"});
}

// Cooked from the level with so much of its lamps' light.
std::string dimmed(const cook::test::TemporaryFolder& folder, const std::string& quick, double share) {
    auto level = cook::test::twoCells();
    for (json& light : level.document["extensions"]["KHR_lights_punctual"]["lights"])
        light["intensity"] = share * light["intensity"].get<double>();
    const std::string pack = (folder.path / "dim.dimmer").string();
    const auto cooked = runDimmer(
        {"cook", cook::test::writeLevel(folder, level).string(), "-o", pack, "--profile", quick, "--quality", "draft"});
    EXPECT_EQ(cooked.exit_code, 0) << cooked.err;
    return pack;
}

// A pack whose lamps have nine tenths of their light is a tenth too dark: with a reference of few paths, taking its
// noise off what is measured leaves anything down to nothing, and passed one time in a few.
TEST_F(VerifyCommand, NoiseLetsNothingPass) {
    const cook::test::TemporaryFolder folder;
    const std::string dim = dimmed(folder, file("quick.json"), 0.9);
    int below = 0;  // by what is left without the noise
    for (const int paths : {2, 4, 8, 16})
        for (int seed = 1; seed <= 6; ++seed) {
            const auto result = gate(file("level.gltf"), dim, paths, seed, "0.05");
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

// Nine tenths of the light are missing, which the noise of 16 paths, a tenth, cannot be.
TEST_F(VerifyCommand, NoiseIsNotBlamedForWhatIsFarAbove) {
    const cook::test::TemporaryFolder folder;
    const auto result = gate(file("level.gltf"), dimmed(folder, file("quick.json"), 0.1), 16, 1, "0.05");
    EXPECT_EQ(result.exit_code, 4);
    EXPECT_THAT(result.err, HasSubstr("is above 0.05"));
    EXPECT_THAT(result.err, testing::Not(HasSubstr("hides")));
}

TEST_F(StressCommand, MemoryThatWasNotJudgedIsNotCalledFlat) {
    const auto result = runDimmer({"stress", pack(), "--cpu", "--frames", "50", "--json", file("stress.json")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(json::parse(readText(file("stress.json")))["memory_flat"].is_null());
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
