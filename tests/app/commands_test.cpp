// The contract with scripts: exit codes, what goes to stdout and what to stderr, names of JSON keys, help.
#include <app/tool_fixture.h>
#include <dimmer/version.h>
#include <fmt/format.h>
#include <pack/sample_pack.h>
#include <write/pack_writer.h>

namespace dimmer::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

using Commands = ToolTest;

// Refused: exit code 2, nothing on stdout, a message on stderr that holds the fragments.
void expectRefused(const ProcessResult& result, const std::vector<std::string>& fragments) {
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.out, IsEmpty());
    for (const std::string& f : fragments) EXPECT_THAT(result.err, HasSubstr(f));
}

void expectKeys(const json& object, const std::vector<std::string>& keys) {
    for (const std::string& key : keys) EXPECT_TRUE(object.contains(key)) << key << " in " << object.dump();
}

TEST_F(Commands, HelpExplainsEachCommandWithUnitsAndAnExample) {
    const auto overview = runDimmer({"--help"});
    EXPECT_EQ(overview.exit_code, 0);
    EXPECT_THAT(overview.out, AllOf(HasSubstr("Exit codes: 0 done"), HasSubstr("3 over budget")));
    EXPECT_THAT(overview.err, IsEmpty());
    const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
        {"cook", {"LEVEL", "--profile", "--quality", "--threads", "[0 - 1024]", "bytes", "metre", "=preview"}},
        {"inspect", {"PACK", "--json", "--settings", "bytes"}},
        {"sample", {"PACK", "--points", "--state", "--backend", "lux", "metres", "cm"}},
        {"explain", {"PACK", "--point", "--normal", "metres", "cm", "lux", "bytes"}},
        {"export", {"PACK", "DIR", "lux", "index.json"}},
        {"report", {"PACK", "--verify", "--heatmap", "bytes"}},
        {"bench", {"PACK", "--mode", "--frames", "=100"}},
    };
    for (const auto& [command, words] : commands) {
        EXPECT_THAT(overview.out, HasSubstr("  " + command + " "));
        const auto help = runDimmer({command, "--help"});
        EXPECT_EQ(help.exit_code, 0) << command;
        EXPECT_THAT(help.out, HasSubstr("Example: dimmer " + command + " "));
        for (const std::string& word : words) EXPECT_THAT(help.out, HasSubstr(word)) << command;
    }
    const auto sample = runProcess(DIMMER_SAMPLE_TOOL, {"--help"});
    EXPECT_EQ(sample.exit_code, 0);
    EXPECT_THAT(sample.out, AllOf(HasSubstr("Examples: dimmer-sample "), HasSubstr("pixels")));
}

// Headers, tools and CMake's project say the same.
TEST_F(Commands, SayTheirVersion) {
    const std::string version = DIMMER_PROJECT_VERSION;
    EXPECT_EQ(DIMMER_VERSION, version);
    EXPECT_EQ(fmt::format("{}.{}.{}", DIMMER_VERSION_MAJOR, DIMMER_VERSION_MINOR, DIMMER_VERSION_PATCH), version);
    const auto tool = runDimmer({"--version"});
    EXPECT_EQ(tool.exit_code, 0) << tool.err;
    EXPECT_EQ(tool.out, "dimmer " + version + "\n");
    EXPECT_THAT(tool.err, IsEmpty());
    const auto sample = runProcess(DIMMER_SAMPLE_TOOL, {"--version"});
    EXPECT_EQ(sample.exit_code, 0) << sample.err;
    EXPECT_EQ(sample.out, "dimmer-sample " + version + "\n");
}

TEST_F(Commands, WrongUsage) {
    expectRefused(runDimmer({}), {"dimmer --help"});
    expectRefused(runDimmer({"cokk"}), {"'cokk'", "did you mean 'cook'?"});
    expectRefused(runDimmer({"cook"}), {"LEVEL"});
    expectRefused(runDimmer({"cook", file("level.gltf")}), {"--output"});
    expectRefused(runDimmer({"inspect"}), {"PACK"});
    expectRefused(runDimmer({"inspect", pack(), "--nonsense"}), {"--nonsense"});
    expectRefused(runDimmer({"cook", file("level.gltf"), "-o", file("x"), "--quality", "best"}), {"best", "draft"});
    for (const char* threads : {"-1", "1025", "4294967295", "4294967296"})
        expectRefused(runDimmer({"cook", file("level.gltf"), "-o", file("x"), "--threads", threads}), {"--threads"});
    expectRefused(runDimmer({"sample", pack(), "--points", "-", "--backend", "npu"}), {"npu", "cpu"});
    expectRefused(runDimmer({"bench", pack(), "--frames", "0"}), {"--frames"});
    EXPECT_FALSE(std::filesystem::exists(file("x")));
}

TEST_F(Commands, CookPrintsItsTableAndKeepsProgressOnStderr) {
    EXPECT_THAT(cooked().out, AllOf(HasSubstr("total on the device"), HasSubstr("one"), HasSubstr("both")));
    EXPECT_THAT(cooked().out, Not(HasSubstr("\x1b")));
    // A line per stage: stderr is no terminal.
    EXPECT_THAT(cooked().err, AllOf(HasSubstr("charts"), HasSubstr("encode"), Not(HasSubstr("\r"))));
    const json figures = json::parse(readText(file("cook.json")));
    expectKeys(figures, {"seconds", "rays", "rays_per_second", "peak_bytes", "warnings"});
    expectKeys(figures["seconds"], {"import", "charts", "bake", "encode", "write"});
    expectKeys(figures["bake_seconds"], {"direct light and links", "bounces", "final gather"});
    EXPECT_GT(figures["rays"], 0);
    EXPECT_EQ(figures["file_bytes"], std::filesystem::file_size(pack()));
    const auto piped = cook("piped.dimmer", {"--json", "-"});
    EXPECT_EQ(piped.exit_code, 0);
    EXPECT_TRUE(json::accept(piped.out)) << piped.out;
}

TEST_F(Commands, CookRefusesBadInputAndWritesNothing) {
    write("empty.gltf", "");
    expectRefused(cook("no.dimmer", {}, "empty.gltf"), {"empty.gltf"});
    expectRefused(cook("no.dimmer", {}, "none.gltf"), {"none.gltf"});
    expectRefused(cook("no.dimmer", {}, "level.gltf", "none.json"), {"none.json"});
    write("typo.json", R"({"record": {"threshold": 0.1}})");
    expectRefused(cook("no.dimmer", {}, "level.gltf", "typo.json"), {"typo.json", "did you mean 'records.threshold'?"});
    expectRefused(cook("nowhere/no.dimmer"), {"nowhere", "no folder"});
    expectRefused(cook("."), {"directory"});
    EXPECT_FALSE(std::filesystem::exists(file("no.dimmer")));
    // Where the pack cannot be put is said before the bake, not after.
    EXPECT_THAT(cook("nowhere/no.dimmer").err, Not(HasSubstr("charts")));
}

// The name alone is that of the shipped profile, as it is in every other folder.
TEST_F(Commands, AFileThatAShippedProfileHidesIsPointedAt) {
    write("console", R"({"extends": "quick.json"})");
    const auto cookHere = [](const std::string& profile) {
        return runProcess("/bin/sh", {"-c",
                                      "cd '" + file(".") +
                                          "' && exec \"$0\" cook level.gltf -o here.dimmer --quality "
                                          "draft --set bake.draft.rays=32 --set bake.draft.series_rays=8 --profile " +
                                          profile,
                                      DIMMER_TOOL});
    };
    const std::string warning =
        "dimmer: warning: --profile console is the shipped one, and the file of that name is not "
        "read; --profile ./console reads it\n";
    const auto shipped = cookHere("console"), local = cookHere("./console"), other = cookHere("handheld");
    for (const auto* result : {&shipped, &local, &other}) EXPECT_EQ(result->exit_code, 0) << result->err;
    EXPECT_THAT(shipped.err, HasSubstr(warning));
    for (const auto* result : {&local, &other}) EXPECT_THAT(result->err, Not(HasSubstr("shipped")));
}

// Who reads that a level is amiss may stop the cook there, hours before its end.
TEST_F(Commands, WarnsOfTheLevelBeforeTheBakeAndOnce) {
    json level = json::parse(readText(file("level.gltf")));
    level["nodes"][0]["extras"]["dimmer_texel_densty"] = 2;
    for (json& node : level["nodes"]) {
        json place = node.value("translation", json{0, 0, 0});
        place[0] = place[0].get<float>() + 4000;
        node["translation"] = place;
    }
    write("amiss.gltf", level.dump());
    const auto result = cook("amiss.dimmer", {"--progress", "json"}, "amiss.gltf");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    size_t last = 0;
    for (const char* text :
         {"dimmer_texel_densty", R"("stage":"charts")", "m from the origin", R"("stage":"final gather")"}) {
        const size_t at = result.err.find(text);
        ASSERT_NE(at, std::string::npos) << text << '\n' << result.err;
        EXPECT_GT(at, last) << text;
        last = at;
    }
    for (const char* text : {"dimmer_texel_densty", "m from the origin"})
        EXPECT_EQ(result.err.find(text), result.err.rfind(text)) << result.err;
}

TEST_F(Commands, OverBudgetIsExitCodeThree) {
    write("tight.json", R"({"extends": "quick.json", "budgets": {"total": 1000}})");
    write("kept.dimmer", "the old pack");
    json level = json::parse(readText(file("level.gltf")));
    level["nodes"][0]["extras"]["dimmer_texel_densty"] = 2;
    write("typo.gltf", level.dump());
    const auto result = cook("kept.dimmer", {}, "typo.gltf", "tight.json");
    EXPECT_EQ(result.exit_code, 3);
    // What was to be said of the level may well be the reason.
    EXPECT_THAT(result.err, AllOf(HasSubstr("warning: "), HasSubstr("dimmer_texel_densty")));
    EXPECT_THAT(result.out, IsEmpty());
    EXPECT_THAT(result.err,
                AllOf(HasSubstr("over budget, nothing was written"), HasSubstr("total: "), HasSubstr("'both'")));
    EXPECT_EQ(readText(file("kept.dimmer")), "the old pack");
}

TEST_F(Commands, InspectTableAndSettings) {
    const auto table = runDimmer({"inspect", pack()});
    EXPECT_EQ(table.exit_code, 0);
    EXPECT_THAT(table.err, IsEmpty());
    for (const char* word : {"total on the device", "base lightmaps", "dynamic records", "exposure", "clusters",
                             "batches", "texel records", "energy dropped", "overlap", "one", "both", "two"})
        EXPECT_THAT(table.out, HasSubstr(word));
    const auto settings = runDimmer({"inspect", pack(), "--settings"});
    EXPECT_EQ(settings.exit_code, 0);
    EXPECT_THAT(settings.out, testing::ContainsRegex("lightmaps.texels_per_metre +4[.0]* +desktop"));
    EXPECT_THAT(settings.out, testing::ContainsRegex("bake.draft.rays +32 +quick.json"));
}

// A set's own light and what doors make of it have names of their own, and counts that their bytes follow from: 8 a
// texel, 28 a probe.
TEST_F(Commands, InspectTellsContributionsApart) {
    PackData data = samplePack();
    Random random(1);
    addRandomProbes(data, random);
    const auto bytes = cook::packBytes(data);
    const std::string doors = write("doors.dimmer", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    const auto table = runDimmer({"inspect", doors});
    ASSERT_EQ(table.exit_code, 0) << table.err;
    EXPECT_THAT(table.out, testing::ContainsRegex("contribution +texels +probes +bytes"));
    // emptyPack(): four sets, then of each door always-on light through and off it, and a set's.
    for (const auto& [k, name] : {std::pair<size_t, const char*>{0, "set0"},
                                  {4, "always through door:door0"},
                                  {5, "always off closed door:door0"},
                                  {6, "set0 through door:door0"},
                                  {12, "set0 through door:door0 through door:door1"},
                                  {13, "set1 through door:door0 off closed door:door1"}})
        EXPECT_THAT(table.out,
                    testing::ContainsRegex(fmt::format("\n{} +{} +{} +[0-9]", name, data.contributions[k].receivers,
                                                       data.probes.record_counts[k])));
    const json j = json::parse(runDimmer({"inspect", doors, "--json"}).out);
    for (const json& c : j["contributions"])
        EXPECT_EQ(c["bytes"], 8 * c["receivers"].get<uint64_t>() + 28 * c["probes"].get<uint64_t>());
}

TEST_F(Commands, InspectJson) {
    const auto result = runDimmer({"inspect", pack(), "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json j = json::parse(result.out);
    expectKeys(j, {"format_version", "exposure", "bytes", "receivers", "pages", "contributions", "elements", "clusters",
                   "batches", "overlap_histogram", "settings"});
    EXPECT_FALSE(j.contains("mixed_batches"));
    expectKeys(j["bytes"],
               {"file", "device", "base_lightmap", "dynamic", "local_grids", "global_grid", "ancillary", "meshes"});
    expectKeys(j["receivers"], {"texels", "local_probes", "global_probes"});
    expectKeys(j["pages"][0], {"width", "height"});
    expectKeys(j["contributions"][0], {"light", "doors_open", "doors_closed", "receivers", "bytes", "energy_dropped"});
    expectKeys(j["elements"][0], {"name", "kind", "receivers", "bytes"});
    expectKeys(j["settings"]["quality"], {"value", "from"});

    EXPECT_EQ(j["bytes"]["file"], std::filesystem::file_size(pack()));
    EXPECT_EQ(j["elements"].size(), 3u);
    EXPECT_EQ(j["elements"][1]["name"], "both");
    EXPECT_EQ(j["elements"][1]["kind"], "set");
    EXPECT_EQ(j["contributions"][2]["light"], "two");
    // The histogram holds every texel of every page.
    uint64_t texels = 0, histogram = 0;
    for (const json& page : j["pages"]) texels += page["width"].get<uint64_t>() * page["height"].get<uint64_t>();
    for (const json& count : j["overlap_histogram"]) histogram += count.get<uint64_t>();
    EXPECT_EQ(histogram, texels);

    // To a file, and alone, it is the same.
    ASSERT_EQ(runDimmer({"inspect", pack(), "--json", file("inspect.json")}).exit_code, 0);
    EXPECT_EQ(json::parse(readText(file("inspect.json"))), j);
    EXPECT_EQ(json::parse(runDimmer({"inspect", pack(), "--json"}).out), j);
}

TEST_F(Commands, BenchJson) {
    const auto result = runDimmer({"bench", pack(), "--mode", "cpu", "--frames", "2", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json j = json::parse(result.out);
    expectKeys(j, {"device", "driver", "pack", "cases"});
    std::vector<std::string> names;
    for (const json& c : j["cases"]) {
        expectKeys(c, {"name", "mode", "receivers", "batches", "dispatches", "bytes", "gpu_us", "host_us", "roof_us",
                       "efficiency"});
        expectKeys(c["host_us"], {"min", "median", "max"});
        EXPECT_TRUE(c["gpu_us"].is_null());
        names.push_back(c["name"]);
    }
    EXPECT_THAT(names, testing::IsSupersetOf({"nothing changed", "set one toggled", "set both toggled",
                                              "set two toggled", "all sets changed"}));
    EXPECT_EQ(j["cases"][0]["batches"], 0);
}

// The loader is there, and no driver that it could load.
TEST_F(Commands, WithoutADriverBenchNamesOne) {
    const auto result = runProcess("/usr/bin/env", {"VK_DRIVER_FILES=/no/driver", "VK_ICD_FILENAMES=/no/driver",
                                                    DIMMER_TOOL, "bench", pack(), "--frames", "1"});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("No Vulkan driver was found. On Debian the package mesa-vulkan-drivers"));
    const auto cpu = runProcess("/usr/bin/env", {"VK_DRIVER_FILES=/no/driver", "VK_ICD_FILENAMES=/no/driver",
                                                 DIMMER_TOOL, "bench", pack(), "--frames", "1", "--mode", "cpu"});
    EXPECT_EQ(cpu.exit_code, 0) << cpu.err;
}

TEST_F(Commands, OutputThatCannotBeWrittenIsNoSuccess) {
    // A shell, to give the tool a full disk as stdout.
    const auto result =
        runProcess("/bin/sh", {"-c", std::string("'") + DIMMER_TOOL + "' inspect '" + pack() + "' >/dev/full"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("could not be written"));
    expectRefused(runDimmer({"inspect", pack(), "--json", "/dev/full"}), {"/dev/full", "No space left"});
}

TEST_F(Commands, SampleTool) {
    expectRefused(runProcess(DIMMER_SAMPLE_TOOL, {file("none.dimmer"), "--headless"}), {"none.dimmer"});
    const std::string script = write("bad.script", "frames 1\nat 0 set hal=1\n");
    expectRefused(runProcess(DIMMER_SAMPLE_TOOL, {pack(), "--headless", "--script", script, "--out", file("frames")}),
                  {"bad.script", "2"});
    expectRefused(runProcess(DIMMER_SAMPLE_TOOL, {pack(), "--headless", "--size", "12"}), {"--size"});
}

}  // namespace
}  // namespace dimmer::test
