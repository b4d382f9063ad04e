// Files that a command writes: never its own input or another output, and looked at before the work, not after it.
#include <app/tool_fixture.h>
#include <dimmer/pack.h>
#include <pipeline/level_files.h>

namespace dimmer::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class Outputs : public ToolTest {
   protected:
    static std::string level() { return file("level.gltf"); }
    static std::string points() { return write("points.csv", "x,y,z,nx,ny,nz\n1,0,1,0,1,0\n"); }

    // One message and nothing else: no line of progress either, so nothing was begun.
    static void expectRefusedAtOnce(const std::vector<std::string>& arguments, const std::vector<std::string>& words) {
        const auto result = runDimmer(arguments);
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.out, IsEmpty());
        EXPECT_TRUE(result.err.starts_with("dimmer: error: ")) << arguments[0] << "\n" << result.err;
        EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << arguments[0] << "\n" << result.err;
        for (const std::string& word : words) EXPECT_THAT(result.err, HasSubstr(word));
    }
    static void expectSameFile(const std::vector<std::string>& arguments, const std::string& a, const std::string& b) {
        expectRefusedAtOnce(arguments, {a + " and " + b + " are the same file"});
    }
};

TEST_F(Outputs, NeverTheLevelThePackOrOneAnother) {
    const std::string level_bytes = readText(level()), pack_bytes = readText(pack());
    const std::string new_pack = file("other.dimmer"), json = file("other.json"), csv = points();
    expectSameFile({"cook", level(), "-o", level()}, "--output", "LEVEL");
    expectSameFile({"cook", level(), "-o", new_pack, "--write-level", level()}, "--write-level", "LEVEL");
    expectSameFile({"cook", level(), "-o", new_pack, "--report", new_pack}, "--report", "--output");
    expectSameFile({"cook", level(), "-o", new_pack, "--json", json, "--report", json}, "--report", "--json");
    expectSameFile({"cook", level(), "-o", file("quick.json"), "--profile", file("quick.json")}, "--output",
                   "--profile");
    expectSameFile({"inspect", pack(), "--json", pack()}, "--json", "PACK");
    expectSameFile({"report", pack(), "-o", pack()}, "--output", "PACK");
    expectSameFile({"report", pack(), "-o", file("cook.json"), "--cook", file("cook.json")}, "--output", "--cook");
    for (const char* output : {"--json", "--csv", "--heatmap"})
        expectSameFile({"verify", level(), pack(), output, pack()}, output, "PACK");
    expectSameFile({"verify", level(), pack(), "--heatmap", json, "--json", json}, "--heatmap", "--json");
    expectSameFile({"explain", pack(), "--point", "1,0,1", "--json", pack()}, "--json", "PACK");
    expectSameFile({"bench", pack(), "--plot", pack()}, "--plot", "PACK");
    expectSameFile({"bench", pack(), "--plot", json, "--json", json}, "--plot", "--json");
    expectSameFile({"stress", pack(), "--json", pack()}, "--json", "PACK");
    expectSameFile({"sample", pack(), "--points", csv, "-o", pack()}, "--output", "PACK");
    expectSameFile({"sample", pack(), "--points", csv, "-o", csv}, "--output", "--points");
    expectSameFile({"reference", level(), "--points", csv, "-o", level()}, "--output", "LEVEL");
    expectSameFile({"export", pack(), pack()}, "DIR", "PACK");
    EXPECT_EQ(readText(level()), level_bytes);
    EXPECT_EQ(readText(pack()), pack_bytes);
    for (const std::string& path : {new_pack, json}) EXPECT_FALSE(std::filesystem::exists(path)) << path;
}

// By a URI, escaped or absolute, and by the sky's key, which is no URI.
TEST_F(Outputs, NeverAFileThatTheLevelNames) {
    cook::test::LevelFile parts;
    parts.document = json::parse(R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "parts.bin", "byteLength": 4},
        {"uri": "data:application/octet-stream;base64,AAAA", "byteLength": 3}],
        "images": [{"uri": "wall%20paint.png"}, {"uri": "heat/page_0.png"}],
        "scenes": [{"extras": {"dimmer_sky_image": "sky%20.hdr"}}]})");
    parts.document["extensions"]["EXT_lights_ies"]["lights"] = json::array({{{"uri", file("far.ies")}}});
    const auto binary = parts.glb();
    const std::string csv = points(), gltf = write("parts.gltf", parts.gltfText()),
                      glb = write("parts.glb", {binary.begin(), binary.end()});
    for (const char* name : {"parts.bin", "wall paint.png", "far.ies", "sky%20.hdr"}) {
        const std::string part = write(name, "kept");
        for (const std::string& level : {gltf, glb}) {
            expectSameFile({"cook", level, "-o", part}, "--output", "a file of LEVEL");
            expectSameFile({"cook", level, "-o", file("other.dimmer"), "--report", part}, "--report",
                           "a file of LEVEL");
            expectSameFile({"verify", level, pack(), "--csv", part}, "--csv", "a file of LEVEL");
            expectSameFile({"reference", level, "--points", csv, "-o", part}, "--output", "a file of LEVEL");
        }
        EXPECT_EQ(readText(part), "kept");
    }
    std::filesystem::create_directory(file("heat"));
    const std::string picture = write("heat/page_0.png", "kept");
    expectSameFile({"verify", gltf, pack(), "--heatmap", file("heat")}, "a file of --heatmap", "a file of LEVEL");
    expectSameFile({"report", pack(), "-o", picture, "--heatmap", file("heat")}, "--output", "a file of --heatmap");
    EXPECT_EQ(readText(picture), "kept");
    const std::string deep =
        write("deep.gltf", R"({"extras": )" + std::string(200000, '[') + std::string(200000, ']') + "}");
    expectRefusedAtOnce({"cook", deep, "-o", file("other.dimmer")}, {"deep.gltf", "nests"});
    EXPECT_FALSE(std::filesystem::exists(file("other.dimmer")));
}

// What somebody notes on a node is no file that the level is read from; what comes behind it may be.
TEST_F(Outputs, PropertiesOfTheLevelsOwnAreNoFiles) {
    const std::string level = write("noted.gltf", R"({"asset": {"version": "2.0"},
        "nodes": [{"extras": {"uri": "house.dimmer", "more": [{"uri": "notes.txt"}]}, "name": "a"}],
        "buffers": [{"extras": {"uri": "x"}, "uri": "parts.bin", "byteLength": 4}]})");
    EXPECT_THAT(cook::filesNamedBy(level), testing::ElementsAre(file("parts.bin")));
}

TEST_F(Outputs, NeverAProfileThatTheProfileExtends) {
    const std::string base = write("base.json", R"({"extends": "console"})");
    const std::string middle = write("middle.json", R"({"extends": "base.json"})");
    const std::string top = write("top.json", R"({"extends": "middle.json"})");
    for (const std::string& profile : {base, middle})
        expectSameFile({"cook", level(), "-o", profile, "--profile", top}, "--output", "a file of --profile");
    EXPECT_EQ(readText(base), R"({"extends": "console"})");
}

// The pack is there then, and what was to be said of the level and of the written one is said, once.
TEST_F(Outputs, WhatFailsBesideThePackSaysSo) {
    json warned = json::parse(readText(level()));
    warned["nodes"][0]["extras"]["dimmer_texel_densty"] = 2;
    json& attributes = warned["meshes"][0]["primitives"][0]["attributes"];
    attributes["COLOR_0"] = attributes["POSITION"];
    write("warned.gltf", warned.dump());
    const auto count = [](const std::string& text, const std::string& word) {
        size_t n = 0;
        for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
        return n;
    };
    for (const char* failing : {"--write-level", "--report", "--json"}) {
        std::filesystem::remove(file("warned.dimmer"));
        std::vector<std::string> more = {failing, "/dev/full"};
        if (failing != std::string("--write-level")) more.insert(more.end(), {"--write-level", file("warned.glb")});
        const auto result = cook("warned.dimmer", more, "warned.gltf");
        EXPECT_EQ(result.exit_code, 2) << failing;
        EXPECT_THAT(result.err, AllOf(HasSubstr("dimmer: error: /dev/full"),
                                      HasSubstr("dimmer: The pack has been written: " + file("warned.dimmer") + "\n")));
        EXPECT_EQ(count(result.err, "'dimmer_texel_densty'"), 1u) << failing << result.err;
        EXPECT_EQ(count(result.err, "COLOR_0 is not written"), 1u) << failing << result.err;
        EXPECT_TRUE(Pack::open(file("warned.dimmer")).has_value()) << failing;
    }
}

TEST_F(Outputs, OtherNamesOfTheSameFile) {
    const std::filesystem::path folder = std::filesystem::path(pack()).parent_path();
    std::filesystem::create_directory(folder / "names");
    std::filesystem::create_symlink("../level.dimmer", folder / "names/link");
    std::filesystem::create_hard_link(pack(), folder / "names/hard");
    for (const char* name : {"names/link", "names/hard", "names/../level.dimmer", "./level.dimmer"})
        expectSameFile({"inspect", pack(), "--json", file(name)}, "--json", "PACK");
    // Files that are not there yet.
    std::filesystem::create_symlink("../new.json", folder / "names/new");
    for (const char* name : {"names/new", "names/../new.json"})
        expectSameFile({"bench", pack(), "--json", file("new.json"), "--plot", file(name)}, "--plot", "--json");
    // Of an export too: the pack would be one of its files.
    std::filesystem::create_directory(folder / "light");
    std::filesystem::copy_file(pack(), folder / "light/index.json");
    expectSameFile({"export", file("light/index.json"), file("light")}, "a file of DIR", "PACK");
    EXPECT_EQ(readText(file("light/index.json")), readText(pack()));
    std::filesystem::create_symlink("light/index.json", folder / "linked.dimmer");
    expectSameFile({"export", file("linked.dimmer"), file("light")}, "a file of DIR", "PACK");
}

// Binary glTF under the name of a text is read by nothing that goes by names.
TEST_F(Outputs, AWrittenLevelIsNamedAsWhatItIs) {
    expectRefusedAtOnce({"cook", level(), "-o", file("other.dimmer"), "--write-level", file("final.gltf")},
                        {"--write-level: '" + file("final.gltf") + "'", "end the name in .glb"});
    EXPECT_FALSE(std::filesystem::exists(file("other.dimmer")));
}

// A pack or a page is nothing to print, and a file of that name is hard to be rid of.
TEST_F(Outputs, AMinusIsNoFile) {
    const auto expectRefused = [](const std::vector<std::string>& arguments, const std::string& role,
                                  const std::string& what = "file") {
        expectRefusedAtOnce(arguments, {role + ": '-' is not a " + what + "; write to ./- if you mean that"});
    };
    expectRefused({"cook", level(), "-o", "-"}, "--output");
    expectRefused({"cook", level(), "-o", file("other.dimmer"), "--write-level", "-"}, "--write-level");
    expectRefused({"cook", level(), "-o", file("other.dimmer"), "--report", "-"}, "--report");
    expectRefused({"report", pack(), "-o", "-"}, "--output");
    expectRefused({"verify", level(), pack(), "--csv", "-"}, "--csv");
    expectRefused({"verify", level(), pack(), "--heatmap", "-"}, "--heatmap", "folder");
    expectRefused({"bench", pack(), "--plot", "-"}, "--plot");
    expectRefused({"synth", "--like", "safehouse", "-o", "-"}, "--output");
    expectRefused({"export", pack(), "-"}, "DIR", "folder");
    EXPECT_FALSE(std::filesystem::exists("-"));
    EXPECT_FALSE(std::filesystem::exists(file("other.dimmer")));
    const auto printed = runDimmer({"sample", pack(), "--points", points(), "-o", "-"});
    EXPECT_EQ(printed.exit_code, 0) << printed.err;
    EXPECT_THAT(printed.out, HasSubstr("Er,Eg,Eb"));
}

// It is made before the bake, and its name would be taken then.
TEST_F(Outputs, NeverTheCache) {
    const std::string new_pack = file("other.dimmer"), folder = file("new_cache");
    expectSameFile({"cook", level(), "-o", new_pack, "--cache", new_pack}, "--output", "--cache");
    expectSameFile({"cook", level(), "-o", new_pack, "--report", folder, "--cache", folder}, "--report", "--cache");
    expectSameFile({"cook", level(), "-o", new_pack, "--report", folder, "--cache", folder + "/"}, "--report",
                   "--cache");
    expectSameFile({"cook", level(), "-o", new_pack, "--cache", new_pack + "/in/it"}, "--output", "--cache");
    std::filesystem::create_directory(file("empty"));
    expectSameFile({"cook", level(), "-o", file("empty/.dimmer-cache")}, "--output", "--cache");
    expectRefusedAtOnce({"cook", level(), "-o", new_pack, "--cache", "-"}, {"--cache: '-' is not a folder"});
    for (const std::string& path : {new_pack, folder, file("empty/.dimmer-cache")})
        EXPECT_FALSE(std::filesystem::exists(path)) << path;
}

TEST_F(Outputs, ACacheThatCannotBeIsDoneWithout) {
    const auto result = cook("uncached.dimmer", {"--cache", file(std::string(300, 'n') + "/cache")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("cooked without a cache"));
}

// What would be ignored is refused.
TEST_F(Outputs, ACacheThatNothingWouldUse) {
    const auto expectRefused = [](const std::vector<std::string>& more) {
        const auto result = cook("never.dimmer", more);
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.err, AllOf(HasSubstr(more[0]), HasSubstr("excludes")));
        EXPECT_FALSE(std::filesystem::exists(file("never.dimmer")));
    };
    expectRefused({"--cache", file("some"), "--per-set-passes"});
    expectRefused({"--cache", file("some"), "--grid-baseline", "uniform"});
    expectRefused({"--cache-limit", "10", "--no-cache"});
    expectRefused({"--cache-limit", "10", "--per-set-passes"});
    const auto result = cook("passes.dimmer", {"--per-set-passes", "--no-cache"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Outputs, WhatIsReadOnlyStays) {
    const std::string kept = write("kept.dimmer", "kept");
    std::filesystem::permissions(kept, std::filesystem::perms(0444));
    expectRefusedAtOnce({"cook", level(), "-o", kept}, {"kept.dimmer", "is read-only"});
    EXPECT_EQ(readText(kept), "kept");
}

TEST_F(Outputs, DevicesMayServeTwice) {
    const auto result = runDimmer({"bench", pack(), "--mode", "cpu", "--frames", "1", "--only", "nothing", "--json",
                                   "/dev/null", "--plot", "/dev/null"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Outputs, LookedAtBeforeTheWork) {
    const std::string nowhere = file("nowhere/x"), csv = points();
    const std::string taken = write("taken", "a file");
    const auto expectNoFolder = [&](std::vector<std::string> arguments) {
        expectRefusedAtOnce(arguments, {nowhere, "no folder"});
    };
    for (const char* output : {"--json", "--csv"}) expectNoFolder({"verify", level(), pack(), output, nowhere});
    expectNoFolder({"reference", level(), "--points", csv, "-o", nowhere});
    expectNoFolder({"stress", pack(), "--cpu", "--frames", "2000", "--json", nowhere});
    expectNoFolder({"bench", pack(), "--json", nowhere});
    expectNoFolder({"bench", pack(), "--plot", nowhere});
    expectNoFolder({"sample", pack(), "--points", csv, "-o", nowhere});
    expectNoFolder({"explain", pack(), "--point", "1,0,1", "--json", nowhere});
    expectNoFolder({"synth", "--like", "safehouse", "-o", nowhere});
    expectNoFolder({"report", pack(), "-o", nowhere});
    expectRefusedAtOnce({"verify", level(), pack(), "--heatmap", taken}, {"--heatmap", "taken", "Not a directory"});
    expectRefusedAtOnce({"verify", level(), pack(), "--heatmap", taken + "/deep/er"}, {"--heatmap", "Not a directory"});
    expectRefusedAtOnce({"export", pack(), taken}, {"DIR", "Not a directory"});
    EXPECT_FALSE(std::filesystem::exists(file("nowhere")));
}

TEST_F(Outputs, StdoutIsNoFile) {
    const std::string figures = write("-", R"({"surface": {}, "floor_lux": 1})");
    const auto result = runProcess(
        "/bin/sh", {"-c", "cd '" + file("") + "' && '" + DIMMER_TOOL + "' verify none.gltf '" + pack() + "' --json -"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(std::filesystem::exists(figures)) << "a file of that name is somebody else's";
}

TEST_F(Outputs, NumbersAndNamesThatMeanNothing) {
    expectRefusedAtOnce({"bench", pack(), "--mode", "cpu", "--only", "nothing-like-that"},
                        {"nothing-like-that", "nothing changed, set one toggled", "all sets changed"});
    const auto expectRefused = [](const std::vector<std::string>& arguments, const char* option) {
        const auto result = runDimmer(arguments);
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.err, AllOf(HasSubstr(option), HasSubstr("finite"), Not(HasSubstr("frames"))));
    };
    expectRefused({"stress", pack(), "--cpu", "--frames", "5", "--minutes", "nan"}, "--minutes");
    expectRefused({"verify", file("level.gltf"), pack(), "--points", "1", "--paths", "2", "--max-error", "nan"},
                  "--max-error");
    const auto negative = runDimmer({"verify", file("level.gltf"), pack(), "--max-error", "-1"});
    EXPECT_EQ(negative.exit_code, 2);
    EXPECT_THAT(negative.err, HasSubstr("--max-error: a share of 0 or more is due, not -1"));
    const auto color = runDimmer({"synth", "--like", "yard", "--color", "1", "-o", file("synth.dimmer")});
    EXPECT_EQ(color.exit_code, 2);
    EXPECT_THAT(color.err, AllOf(HasSubstr("--color"), HasSubstr("r11g11b10f")));
}

}  // namespace
}  // namespace dimmer::test
