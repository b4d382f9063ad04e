// What `cook --json` tells a pipeline, of packs that fit and of those that do not.
#include <app/tool_fixture.h>
#include <dimmer/version.h>
#include <fmt/format.h>
#include <sys/stat.h>

namespace dimmer::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class CookJson : public ToolTest {
   protected:
    static json read(const std::string& path) { return json::parse(readText(path), nullptr, false); }
    static json inspect(const std::string& path) { return json::parse(runDimmer({"inspect", path, "--json"}).out); }
    static json cookTight(const std::string& to) {
        write("tight.json", R"({"extends": "quick.json", "budgets": {"total": 30000, "dynamic": 15000}})");
        const auto result = cook("over.dimmer", {"--json", to}, "level.gltf", "tight.json");
        EXPECT_EQ(result.exit_code, 3) << result.err;
        EXPECT_FALSE(std::filesystem::exists(file("over.dimmer")));
        return to == "-" ? json::parse(result.out, nullptr, false) : read(to);
    }
    static void expectNamed(const json& j, const std::string& result, const std::string& profile) {
        EXPECT_EQ(j["result"], result);
        EXPECT_EQ(j["version"], DIMMER_VERSION);
        EXPECT_EQ(j["level"], file("level.gltf"));
        EXPECT_EQ(j["profile"], file(profile));
        EXPECT_EQ(j["quality"], "draft");
    }
};

TEST_F(CookJson, OfAPackSaysWhatInspectSays) {
    const json figures = read(file("cook.json")), inspected = inspect(pack());
    expectNamed(figures, "cooked", "quick.json");
    for (const char* block : {"bytes", "elements", "budgets"}) EXPECT_EQ(figures[block], inspected[block]) << block;
    EXPECT_FALSE(figures.contains("remedies"));
    uint64_t sum = 0;
    for (const char* part : {"base_lightmap", "dynamic", "local_grids", "global_grid", "ancillary"})
        sum += figures["bytes"][part].get<uint64_t>();
    EXPECT_EQ(figures["bytes"]["device"], sum);
    EXPECT_EQ(figures["bytes"]["file"], std::filesystem::file_size(pack()));
}

// What goes into a pipe or nowhere is there only once.
TEST_F(CookJson, NamesThePackThatWentElsewhere) {
    const std::string bytes = readText(pack());
    std::string id;  // docs/format.md: 8 bytes at 24, the lowest first
    for (size_t i = 32; i-- > 24;) id += fmt::format("{:02x}", static_cast<unsigned char>(bytes.at(i)));
    EXPECT_EQ(read(file("cook.json"))["pack_id"], id);
    ASSERT_EQ(mkfifo(file("pipe").c_str(), 0600), 0);
    // A cook that waits for a second reader is ended.
    const auto piped = runProcess(
        "/bin/sh", {"-c", "cat '" + file("pipe") + "' >'" + file("copy") + "' & exec timeout 60 \"$0\" \"$@\"",
                    DIMMER_TOOL, "cook", file("level.gltf"), "-o", file("pipe"), "--profile", file("quick.json"),
                    "--quality", "draft", "--json", file("piped.json")});
    EXPECT_EQ(piped.exit_code, 0) << piped.err;
    EXPECT_EQ(read(file("piped.json"))["pack_id"], id);
    const auto nowhere = runDimmer({"cook", file("level.gltf"), "-o", "/dev/null", "--profile", file("quick.json"),
                                    "--quality", "draft", "--json", "-"});
    EXPECT_EQ(nowhere.exit_code, 0) << nowhere.err;
    EXPECT_EQ(json::parse(nowhere.out, nullptr, false)["pack_id"], id);
}

// Cooked without the budgets, the pack has the very bytes that were too many.
TEST_F(CookJson, OverBudgetSaysWhatThePackWouldHaveCost) {
    for (const std::string& to : {file("over.json"), std::string("-")}) {
        const json figures = cookTight(to);
        expectNamed(figures, "over_budget", "tight.json");
        json bytes = inspect(pack())["bytes"];
        bytes.erase("file");
        EXPECT_EQ(figures["bytes"], bytes);
        EXPECT_EQ(figures["elements"], inspect(pack())["elements"]);
        EXPECT_EQ(figures["budgets"]["total"], 30000);
        EXPECT_EQ(figures["budgets"]["dynamic"], 15000);
        EXPECT_GT(figures["bytes"]["device"], 30000);
        for (const char* of_a_file : {"pack_id", "file_bytes"}) EXPECT_FALSE(figures.contains(of_a_file)) << of_a_file;
    }
}

TEST_F(CookJson, ARemedyThatFitsCooks) {
    const json remedies = cookTight(file("over.json"))["remedies"];
    ASSERT_FALSE(remedies.empty());
    size_t fitting = 0;
    for (const json& remedy : remedies) {
        EXPECT_GT(remedy["saves"], 0);
        EXPECT_TRUE(remedy.contains("error"));
        std::istringstream words(remedy["options"].get<std::string>());
        std::vector<std::string> more;
        for (std::string word; words >> word;) more.push_back(word);
        EXPECT_EQ(more.size(), 2 * remedy["changes"].size());
        if (!remedy["fits"]) continue;
        ++fitting;
        const auto cooked = cook("remedied.dimmer", more, "level.gltf", "tight.json");
        EXPECT_EQ(cooked.exit_code, 0) << remedy << cooked.err;
    }
    EXPECT_GT(fitting, 0u);
}

TEST_F(CookJson, OfAnEarlierCookDoesNotOutliveAFailedOne) {
    const std::string figures = readText(file("cook.json"));
    const auto expectGone = [&](const std::string& pack_name, const std::string& level, const std::string& profile) {
        const std::string old = write("old.json", figures);
        const auto result = cook(pack_name, {"--json", old}, level, profile);
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_FALSE(std::filesystem::exists(old)) << result.err;
    };
    expectGone("new.dimmer", "none.gltf", "quick.json");
    expectGone("new.dimmer", "level.gltf", "none.json");
    expectGone("nowhere/new.dimmer", "level.gltf", "quick.json");
    // Over budget it is written anew.
    EXPECT_EQ(cookTight(write("old.json", figures))["result"], "over_budget");
    // Those of a version that named no result, too, and behind a link the link stays.
    json before = json::parse(figures);
    before.erase("result");
    write("before.json", before.dump());
    std::filesystem::create_symlink("before.json", file("link.json"));
    EXPECT_EQ(cook("new.dimmer", {"--json", file("link.json")}, "none.gltf").exit_code, 2);
    EXPECT_FALSE(std::filesystem::exists(file("before.json")));
    EXPECT_TRUE(std::filesystem::is_symlink(file("link.json")));
}

TEST_F(CookJson, OfAnEarlierCookDoesNotOutliveAUsageError) {
    const std::string figures = readText(file("cook.json")), level = file("level.gltf"), old = file("old.json");
    const std::string new_pack = file("new.dimmer");
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{level, "-o", new_pack, "--json", old, "--quality", "ultra"},
          {level, "--quality", "ultra", "--json", old, "-o", new_pack},
          {level, "-o", new_pack, "--json=" + old, "--nonsense"},
          {level, "--json", old},
          {"--json", old, "-o", new_pack},
          {level, "-o", new_pack, "--json", old, "--threads"}}) {
        write("old.json", figures);
        std::vector<std::string> all = {"cook"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        EXPECT_EQ(runDimmer(all).exit_code, 2);
        EXPECT_FALSE(std::filesystem::exists(old)) << testing::PrintToString(arguments);
    }
    // Neither by another command, by one that asks for help, nor what is an input, another output or no figures.
    write("old.json", figures);
    const std::string notes = write("notes.json", "mine");
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"inspect", pack(), "--json", old, "--nonsense"},
          {"cook", level, "--json", old, "--help"},
          {"cook", old, "-o", new_pack, "--json", old, "--nonsense"},
          {"cook", level, "-o", new_pack, "--profile", old, "--json", old, "--nonsense"},
          {"cook", level, "-o", old, "--json", old, "--nonsense"},
          {"cook", level, "-o", new_pack, "--json", notes, "--nonsense"}}) {
        runDimmer(arguments);
        EXPECT_EQ(readText(old), figures) << testing::PrintToString(arguments);
    }
    EXPECT_EQ(readText(notes), "mine");
}

TEST_F(CookJson, AFailedCookRemovesNothingElse) {
    for (const std::string& text : {std::string("notes"), std::string(R"({"result": "mine", "seconds": 1})"),
                                    std::string(100000, '[') + std::string(100000, ']')}) {
        const std::string other = write("other.json", text);
        EXPECT_EQ(cook("new.dimmer", {"--json", other}, "none.gltf").exit_code, 2);
        EXPECT_TRUE(readText(other) == text);
    }
    // Figures that are an input or another output as well are refused as they are.
    const std::string figures = readText(file("cook.json")), twice = write("twice.json", figures);
    for (const auto& [pack_name, level, profile] : {std::tuple{"new.dimmer", "twice.json", "quick.json"},
                                                    {"new.dimmer", "level.gltf", "twice.json"},
                                                    {"twice.json", "level.gltf", "quick.json"}}) {
        const auto result = cook(pack_name, {"--json", twice}, level, profile);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.err, HasSubstr("are the same file"));
        EXPECT_EQ(readText(twice), figures);
    }
}

TEST_F(CookJson, WithoutAVerdictPrintsNothing) {
    const auto result = cook("new.dimmer", {"--json", "-"}, "none.gltf");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.out, IsEmpty());
}

}  // namespace
}  // namespace dimmer::test
