// Cooks with a cache: the same bytes as without, and only what changed is made again.
#include <cache/scene_keys.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <pipeline/small_level.h>

#include <fstream>
#include <set>
#include <thread>

namespace dimmer::cook::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr const char* quick_profile = R"({"bake": {"draft":
    {"samples_per_texel": 2, "series_rays": 8, "rays": 128, "emitter_samples": 2, "noise": 0.2, "bounces": 8}}})";

// Two rooms with a door between, lamps of three sets, one of them red and partly emissive, and a shelf with a light
// grid of its own: everything that terms can depend on.
LevelFile houseOfTwo() {
    LevelFile level = twoCells();
    const int white = addWhite(level), glow = addWhite(level, {{"emissiveFactor", {1, 0.5, 0.1}}});
    level.addNode({{"name", "panel"},
                   {"mesh", level.addSquareMesh(glow)},
                   {"translation", {1, 1, 0.2}},
                   {"scale", {0.3, 0.3, 0.3}},
                   {"extras", {{"dimmer_light_set", "one"}}}});
    level.addNode({{"name", "leaf"},
                   {"mesh", addRoomMesh(level, {0.9f, 0.2f, 1.2f}, 0.6f, white)},
                   {"extras", {{"dimmer_door", "flap"}}}});
    level.addNode({{"name", "shelf"},
                   {"mesh", level.addSquareMesh(white)},
                   {"translation", {0.5, 0.6, 1.5}},
                   {"scale", {0.3, 0.3, 0.3}},
                   {"extras", {{"dimmer_lighting", "local_grid"}}}});
    level.document["extensions"]["KHR_lights_punctual"]["lights"][0]["color"] = {1, 0.2, 0.1};
    return level;
}

json& lamp(LevelFile& level, size_t index) {
    return level.document["extensions"]["KHR_lights_punctual"]["lights"][index];
}

struct CachedCook : testing::Test {
    const TemporaryFolder folder;
    std::string profile = writeText(folder, "quick.json", quick_profile).string();

    CookResult run(const LevelFile& level, bool with_cache, const std::string& pack = "level.dimmer",
                   uint64_t cache_bytes_max = uint64_t{4} << 30) {
        SilentProgress silent;
        CookOptions options{
            .level = writeLevel(folder, level), .pack = folder.path / pack, .profile = profile, .quality = "draft"};
        if (with_cache) options.cache = folder.path / "cache";
        options.cache_bytes_max = cache_bytes_max;
        auto result = cook(options, silent);
        EXPECT_TRUE(result.has_value()) << result.error().message;
        return result ? std::move(*result) : CookResult{};
    }
    std::string bytes(const std::string& pack) const {
        std::ifstream file(folder.path / pack, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    // Cooks with the cache and without; expects the same bytes; the stages that were made.
    std::vector<std::string> made(const LevelFile& level) {
        const CookResult result = run(level, true);
        run(level, false, "uncached.dimmer");
        EXPECT_GT(bytes("level.dimmer").size(), 1000u);
        EXPECT_TRUE(bytes("level.dimmer") == bytes("uncached.dimmer"));
        std::vector<std::string> stages;
        for (const CacheLine& line : result.stats.cache)
            if (!line.reused) stages.push_back(line.what);
        return stages;
    }
    std::string why(const LevelFile& level, const std::string& what) {
        for (const CacheLine& line : run(level, true).stats.cache)
            if (line.what == what) return line.why;
        return "no such stage";
    }
};

TEST_F(CachedCook, NothingChangedNothingMade) {
    const LevelFile level = houseOfTwo();
    EXPECT_THAT(made(level), ElementsAre("pack", "charts", "always-on light", "light set 'one'", "light set 'both'",
                                         "light set 'two'", "where rays end"));
    EXPECT_THAT(made(level), IsEmpty());
    const CookResult again = run(level, true);
    EXPECT_EQ(again.stats.rays, 0u);
    EXPECT_EQ(again.pack.elements.size(), 4u);  // the result is as full as a cook's
}

TEST_F(CachedCook, ASetMadeBrighterIsMultiplied) {
    LevelFile level = houseOfTwo();
    made(level);
    // All of "two": its one lamp; then of "one": lamp and panel, by the same factor per channel.
    lamp(level, 2)["intensity"] = 137.31;
    lamp(level, 2)["color"] = {0.3, 0.9, 0.7};
    EXPECT_THAT(made(level), ElementsAre("pack"));
    lamp(level, 0)["intensity"] = 100 * 1.7;
    for (json& m : level.document["materials"])
        if (m.contains("emissiveFactor")) m["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 1.7;
    level.document["extensionsUsed"].push_back("KHR_materials_emissive_strength");
    EXPECT_THAT(made(level), ElementsAre("pack"));
}

TEST_F(CachedCook, AnyOtherEditOfASetMakesThatSet) {
    LevelFile level = houseOfTwo();
    made(level);
    for (json& node : level.document["nodes"])
        if (node.value("name", "") == "lamp3") node["translation"][0] = 8.7;
    EXPECT_THAT(made(level), ElementsAre("pack", "light set 'two'"));
    lamp(level, 1)["intensity"] = 50;  // one of two lamps
    EXPECT_THAT(made(level), ElementsAre("pack", "light set 'both'"));
    lamp(level, 0)["intensity"] = 50;  // not the panel
    EXPECT_THAT(made(level), ElementsAre("pack", "light set 'one'"));
    level.addLight("sun", {{"type", "directional"}, {"intensity", 100}}, json::object());
    EXPECT_THAT(made(level), ElementsAre("pack", "always-on light"));
    EXPECT_THAT(why(level, "pack"), IsEmpty());
}

TEST_F(CachedCook, ABrighterSkyIsMultiplied) {
    LevelFile level = houseOfTwo();
    json& extras = level.document["scenes"][0]["extras"];
    made(level);
    extras["dimmer_sky_luminance"] = 9.7;
    EXPECT_THAT(made(level), ElementsAre("pack"));
    extras["dimmer_sky_color"] = {0.6, 0.8, 1};
    EXPECT_THAT(made(level), ElementsAre("pack", "always-on light"));
    level.addLight("sun", {{"type", "directional"}, {"intensity", 100}}, json::object());
    EXPECT_THAT(made(level), ElementsAre("pack", "always-on light"));
    extras["dimmer_sky_luminance"] = 11;  // beside the sun's another mixture
    EXPECT_THAT(made(level), ElementsAre("pack", "always-on light"));
}

// Lamp by lamp: brightness of one is a multiplication, and what moves is baked alone.
TEST_F(CachedCook, OfLampsTakenApartTheEditedOneIsMade) {
    profile =
        writeText(
            folder, "apart.json",
            std::string(quick_profile).insert(std::string(quick_profile).find("\"bounces"), "\"lamps_apart\": 4, "))
            .string();
    LevelFile level = houseOfTwo();
    level.addNode({{"name", "ball"}, {"translation", {1, 1, 1}}, {"extras", {{"dimmer_dynamic", true}}}});
    level.addNode({{"name", "other leaf"},
                   {"mesh", addRoomMesh(level, {0.2f, 0.2f, 1.2f}, 0.4f, 0)},
                   {"extras", {{"dimmer_door", "hatch"}}}});
    level.document["scenes"][0]["extras"]["dimmer_combinations"] = {{"both", "door:flap", "door:hatch"}};
    EXPECT_THAT(made(level), testing::IsSupersetOf({"light set 'one, surfaces'", "light set 'one, lamp lamp1'",
                                                    "light set 'both, lamp lamp2'", "light set 'both, lamp lamp4'",
                                                    "light set 'two'"}));
    lamp(level, 1)["intensity"] = 50;  // one of two lamps
    EXPECT_THAT(made(level), ElementsAre("pack"));
    lamp(level, 0)["color"] = {0.3, 0.2, 0.9};  // not the panel
    EXPECT_THAT(made(level), ElementsAre("pack"));
    for (json& node : level.document["nodes"])
        if (node.value("name", "") == "lamp4") node["translation"][0] = 9.2;
    const auto lightMade = [&] {
        std::vector<std::string> light;
        for (const std::string& stage : made(level))
            if (stage.starts_with("light set") || stage.starts_with("always") || stage == "charts")
                light.push_back(stage);
        return light;
    };
    EXPECT_THAT(lightMade(), ElementsAre("light set 'both, lamp lamp4'"));
    for (json& node : level.document["nodes"])
        if (node.value("name", "") == "lamp4") node["name"] = "renamed";
    EXPECT_THAT(lightMade(), ElementsAre("light set 'both, lamp renamed'"));
    level.addLight("sun", {{"type", "directional"}, {"intensity", 100}}, json::object());
    EXPECT_THAT(lightMade(), ElementsAre("always-on light, lamp sun"));  // the sky is as it was
    lamp(level, 4)["intensity"] = 250;
    EXPECT_THAT(made(level), ElementsAre("pack"));
    level.document["scenes"][0]["extras"]["dimmer_sky_luminance"] = 8;
    EXPECT_THAT(made(level), ElementsAre("pack"));
}

// A set may have the name that always-on lamps have when they are taken apart: its light has a threshold, theirs none.
TEST(SceneKeys, ALampThatIsAlwaysOnIsNoSetOfThatName) {
    Scene scene;
    scene.lights.emplace_back().light_set = 0;
    scene.light_sets.push_back({.name = "always-on light, lamp sun"});
    const Key of_set = lampsKey(scene, 1);
    scene.light_sets[0].always_on = true;
    EXPECT_NE(lampsKey(scene, 1), of_set);
}

TEST_F(CachedCook, ASetMoreOrLessLeavesTheOthers) {
    LevelFile level = houseOfTwo();
    made(level);
    // First in the file, so that every other set's number changes.
    LevelFile more = level;
    more.addLight("newcomer", {{"type", "point"}, {"intensity", 70}}, {{"dimmer_light_set", "new"}});
    json& nodes = more.document["nodes"];
    json& roots = more.document["scenes"][0]["nodes"];
    nodes.back()["translation"] = {1.2, 1.6, 0.4};
    std::rotate(roots.begin(), roots.end() - 1, roots.end());
    EXPECT_THAT(made(more), ElementsAre("pack", "light set 'new'"));
    EXPECT_EQ(run(more, true).pack.elements[0].name, "new");
    EXPECT_THAT(made(level), IsEmpty());
}

TEST_F(CachedCook, GeometryMakesEverything) {
    LevelFile level = houseOfTwo();
    made(level);
    for (json& node : level.document["nodes"])
        if (node.value("name", "") == "cell2") node["translation"] = {0, 0, 0.1};
    EXPECT_THAT(made(level), testing::SizeIs(7));
    EXPECT_THAT(made(level), IsEmpty());
    level.document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.6, 0.7, 0.7, 1};
    EXPECT_THAT(made(level), testing::SizeIs(7));
}

TEST_F(CachedCook, BudgetsAndNamesOfFilesMakeNoLight) {
    const LevelFile level = houseOfTwo();
    made(level);
    const std::string text = std::string(quick_profile);
    profile = writeText(folder, "budget.json", text.substr(0, text.size() - 1) + R"(, "budgets": {"total": 9000000}})")
                  .string();
    EXPECT_THAT(made(level), ElementsAre("pack"));
    profile = writeText(folder, "finer.json", text.substr(0, text.size() - 1) + R"(, "records": {"threshold": 0.02}})")
                  .string();
    EXPECT_THAT(made(level),
                ElementsAre("pack", "always-on light", "light set 'one'", "light set 'both'", "light set 'two'"));
}

// What a warning would name is known anew; no light is made for it.
TEST_F(CachedCook, ARenamedLampMakesThePackAlone) {
    LevelFile level = houseOfTwo();
    made(level);
    for (json& node : level.document["nodes"])
        if (node["name"] == "lamp1") node["name"] = "lamp_one";
    EXPECT_THAT(made(level), ElementsAre("pack"));
}

// Numbers and names of the file are no part of what is baked.
TEST_F(CachedCook, ACameraFirstOrNewNamesMakeThePackAlone) {
    LevelFile level = houseOfTwo();
    level.document["nodes"].back().erase("name");  // the shelf's: it is called by its number
    made(level);
    level.document["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}}};
    json& nodes = level.document["nodes"];
    nodes.insert(nodes.begin(), json{{"name", "camera"}, {"camera", 0}});
    json& roots = level.document["scenes"][0]["nodes"];
    for (json& root : roots) root = root.get<int>() + 1;
    roots.insert(roots.begin(), 0);
    EXPECT_THAT(made(level), ElementsAre("pack"));
    for (json& node : nodes)
        if (node.value("name", "") == "cell1") node["name"] = "kitchen";
    EXPECT_THAT(made(level), ElementsAre("pack"));
    EXPECT_TRUE(std::ranges::any_of(run(level, true).pack.meshes, [](const Mesh& m) { return m.node == "kitchen"; }));
    level.document["materials"][0]["name"] = "plaster";
    EXPECT_THAT(made(level), IsEmpty());
    // Meshes in another order, which nodes name by their numbers.
    json& meshes = level.document["meshes"];
    std::swap(meshes[0], meshes[1]);
    for (json& node : nodes)
        if (node.contains("mesh") && node["mesh"] < 2) node["mesh"] = 1 - node["mesh"].get<int>();
    EXPECT_THAT(made(level), IsEmpty());
}

// Warnings of charts name nodes as they are called now.
TEST_F(CachedCook, WarningsOfChartsThatAreAllThereNameTheNode) {
    LevelFile level = houseOfTwo();
    level.document["nodes"][0]["extras"]["dimmer_texel_density"] = 40;  // 2 m: longer than a page
    profile =
        writeText(folder, "pages.json", std::string(quick_profile).insert(1, R"("lightmaps": {"page_size": 64}, )"))
            .string();
    const auto warned = [&] {
        std::string of;
        for (const std::string& w : run(level, true).stats.warnings)
            if (w.find("one of its surfaces is") != std::string::npos) of += w.substr(w.find("node '")) + "\n";
        return of;
    };
    EXPECT_THAT(warned(), testing::StartsWith("node 'cell1': one of its surfaces is 80 texels long"));
    level.document["nodes"][0]["name"] = "kitchen";
    EXPECT_THAT(warned(), testing::StartsWith("node 'kitchen': one of its surfaces is 80 texels long"));
    EXPECT_THAT(made(level), IsEmpty());
}

// Too little for a level: every cook would make all of it again, and nobody would know why.
TEST_F(CachedCook, ALimitThatTheLevelDoesNotFitIsWarnedOf) {
    const LevelFile level = houseOfTwo();
    EXPECT_THAT(run(level, true).stats.warnings, testing::Not(testing::Contains(HasSubstr("--cache-limit"))));
    EXPECT_THAT(run(level, true, "level.dimmer", 2000).stats.warnings,
                testing::Contains(testing::AllOf(HasSubstr("2.0 kB"), HasSubstr("--cache-limit"))));
    // What others left goes first, and is no matter.
    std::filesystem::remove_all(folder.path / "cache");
    run(level, true);
    uint64_t bytes = 0;
    const uint64_t pack = std::filesystem::file_size(folder.path / "level.dimmer");
    const auto before = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
    for (const auto& file : std::filesystem::directory_iterator(folder.path / "cache")) {
        bytes += file.file_size();
        std::filesystem::last_write_time(file, before);
    }
    LevelFile brighter = level;
    lamp(brighter, 2)["intensity"] = 137.31;
    // The pack before goes; all that both cooks use stays.
    EXPECT_THAT(run(brighter, true, "level.dimmer", bytes + pack / 2).stats.warnings,
                testing::Not(testing::Contains(HasSubstr("--cache-limit"))));
}

// The same with a thing that moves, and so with a global grid.
LevelFile houseWithGrid() {
    LevelFile level = houseOfTwo();
    level.addNode({{"name", "ball"}, {"translation", {1, 1, 1}}, {"extras", {{"dimmer_dynamic", true}}}});
    return level;
}

std::vector<std::string> gridStages() {
    return {"global grid", "light at probe places: always-on light", "light at probe places: light set 'one'",
            "light at probe places: light set 'both'", "light at probe places: light set 'two'"};
}

TEST_F(CachedCook, ASetMadeBrighterLeavesTheGrid) {
    LevelFile level = houseWithGrid();
    made(level);
    lamp(level, 2)["intensity"] = 137.31;
    lamp(level, 2)["color"] = {0.3, 0.9, 0.7};
    EXPECT_THAT(made(level), ElementsAre("pack"));
    EXPECT_FALSE(run(level, true).pack.probes.global.empty());
}

// Where it is does not matter to the grid, as long as the grid's box reaches there.
TEST_F(CachedCook, AThingThatMovesWithinTheLevelLeavesTheGrid) {
    LevelFile level = houseWithGrid();
    made(level);
    const auto move = [&](json to) {
        for (json& node : level.document["nodes"])
            if (node.value("name", "") == "ball") node["translation"] = std::move(to);
    };
    move({0.5, 1.2, 1});
    EXPECT_THAT(made(level), ElementsAre("pack"));
    move({0.5, 30, 1});
    EXPECT_THAT(made(level), testing::IsSupersetOf({"pack", "global grid"}));
}

// Of the other groups it asks for light at the new places around the lamp alone: from what their surfaces send out, or
// where that is gone, from their bounces anew.
TEST_F(CachedCook, ALampMovedMakesTheGridFromWhatIsKnown) {
    LevelFile level = houseWithGrid();
    made(level);
    std::vector<std::string> stages = {"pack", "light set 'two'"};
    for (const std::string& stage : gridStages()) stages.push_back(stage);
    for (const char* stage : {"where rays end", "places in the open"}) stages.push_back(stage);  // around the lamp
    const auto move = [&](double x) {
        for (json& node : level.document["nodes"])
            if (node.value("name", "") == "lamp3") node["translation"][0] = x;
    };
    const auto kept = [&](const char* kind) {
        return std::ranges::count_if(
            std::filesystem::directory_iterator(folder.path / "cache"),
            [&](const auto& entry) { return entry.path().filename().string().starts_with(kind); });
    };
    const auto places = kept("places-"), sites = kept("sites-");
    EXPECT_GT(places, 2);  // how much is free, all over the level, and around each lamp
    // Four groups at the blocks all over the level, around each lamp and at the box's corners.
    const auto blocks = sites / 4;
    EXPECT_EQ(sites, 4 * blocks);
    EXPECT_GT(blocks, 2);
    move(8.7);
    EXPECT_EQ(made(level), stages);
    EXPECT_EQ(kept("places-"), places + 1);  // around the lamp that moved
    // The lamp's own group at all blocks, the other three at the one around it.
    EXPECT_EQ(kept("sites-"), sites + blocks + 3);
    for (const auto& entry : std::filesystem::directory_iterator(folder.path / "cache"))
        if (entry.path().filename().string().starts_with("radiance-")) std::filesystem::remove(entry.path());
    move(8.6);
    stages.push_back("light that surfaces send on");
    EXPECT_EQ(made(level), stages);
}

// What rays meet is the same wherever a lamp stands.
TEST_F(CachedCook, RaysOfEarlierCooksAreNotTracedAgain) {
    LevelFile level = houseWithGrid();
    run(level, true);
    const auto raysWithLampAt = [&](double x) {
        for (json& node : level.document["nodes"])
            if (node.value("name", "") == "lamp3") node["translation"][0] = x;
        return run(level, true).stats.rays;
    };
    const uint64_t known = raysWithLampAt(8.7);
    for (const auto& entry : std::filesystem::directory_iterator(folder.path / "cache"))
        if (entry.path().filename().string().starts_with("rays-")) std::filesystem::remove(entry.path());
    const uint64_t unknown = raysWithLampAt(8.6);
    EXPECT_GT(known, 0u);
    EXPECT_LT(3 * known, unknown);  // shadow rays, rays aimed at doors, and places around the lamp are new
}

// Lamps of two sets change places in the file: each set's are in the same order as before, all together are not, and
// the grid looks around them one after the other.
TEST_F(CachedCook, LampsThatTakeTurnsOtherwiseMakeTheGridAlone) {
    LevelFile level = houseWithGrid();
    for (const auto& [name, x] : {std::pair{"one", 1.4}, {"two", 9.4}}) {
        const int index = level.addLight(std::string("second_") + name, {{"type", "point"}, {"intensity", 30}},
                                         {{"dimmer_light_set", name}, {"dimmer_bake", "full"}});
        level.node(index)["translation"] = {x, 1.6, 0.4};
    }
    made(level);
    json& roots = level.document["scenes"][0]["nodes"];
    std::swap(roots[roots.size() - 1], roots[roots.size() - 2]);
    EXPECT_THAT(made(level), ElementsAre("pack", "global grid"));
    EXPECT_THAT(made(level), IsEmpty());
}

TEST_F(CachedCook, APlayAreaMakesTheGridAlone) {
    LevelFile level = houseWithGrid();
    made(level);
    const int area = level.addNode({{"name", "play"}, {"extras", {{"dimmer_play_area", 1}}}});
    level.node(area)["translation"] = {2, 1, 1};
    EXPECT_THAT(made(level), ElementsAre("pack", "global grid"));
}

// Who finds the pack whole uses what it was made from: the next edit needs it.
TEST_F(CachedCook, APackThatIsFoundKeepsItsParts) {
    const LevelFile level = houseOfTwo();
    run(level, true);
    const auto before = std::filesystem::file_time_type::clock::now() - std::chrono::hours(48);
    size_t entries = 0;
    for (const auto& file : std::filesystem::directory_iterator(folder.path / "cache"))
        std::filesystem::last_write_time(file, before), ++entries;
    EXPECT_GT(entries, 5u);
    EXPECT_THAT(made(level), IsEmpty());
    for (const auto& file : std::filesystem::directory_iterator(folder.path / "cache"))
        EXPECT_GT(std::filesystem::last_write_time(file), before) << file.path();
}

TEST_F(CachedCook, DamagedEntriesAreMadeAgain) {
    const LevelFile level = houseWithGrid();
    made(level);
    std::set<std::string> damaged;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path / "cache")) {
        std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(static_cast<std::streamoff>(entry.file_size() / 2 + 20));
        file.put('!').put('?');
        const std::string name = entry.path().filename().string();
        damaged.insert(name.substr(0, name.find('-')));
    }
    EXPECT_THAT(damaged,
                ElementsAre("charts", "grid", "ledger", "light", "pack", "places", "radiance", "rays", "sites"));
    SilentProgress silent;
    const CookResult result = run(level, true);
    std::set<std::string> told;
    for (const CacheLine& line : result.stats.cache) {
        told.insert(line.what);
        EXPECT_FALSE(line.reused) << line.what;
        EXPECT_EQ(line.why, "the entry is damaged") << line.what;
    }
    EXPECT_TRUE(told.contains("where rays end") && told.contains("places in the open"));
    EXPECT_TRUE(bytes("level.dimmer") == bytes("uncached.dimmer"));
    EXPECT_THAT(made(level), IsEmpty());
}

TEST_F(CachedCook, SaysWhy) {
    LevelFile level = houseOfTwo();
    EXPECT_EQ(why(level, "light set 'two'"), "first cook of this pack here");
    lamp(level, 1)["intensity"] = 50;
    EXPECT_EQ(why(level, "light set 'both'"), "lamps of light set 'both' changed");
    level.document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.6, 0.7, 0.7, 1};
    EXPECT_EQ(why(level, "charts"), "geometry changed");
    lamp(level, 1)["intensity"] = 51;
    std::filesystem::remove_all(folder.path / "cache");
    EXPECT_EQ(why(level, "charts"), "first cook of this pack here");
}

// A cook that finds its pack whole asks for no parts, and is the last one all the same.
TEST_F(CachedCook, SaysWhySinceAPackThatWasFoundWhole) {
    LevelFile level = houseOfTwo();
    run(level, true);
    LevelFile painted = level;
    painted.document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.6, 0.7, 0.7, 1};
    run(painted, true);
    EXPECT_EQ(why(level, "pack"), "");
    lamp(level, 1)["intensity"] = 50;
    EXPECT_EQ(why(level, "light set 'both'"), "lamps of light set 'both' changed");
}

// Each round of --fit is another cook: a moved lamp changes no threshold in any of them.
TEST_F(CachedCook, RoundsOfFitAreEachComparedWithTheirOwn) {
    LevelFile level = houseOfTwo();
    const uint64_t whole = costOf(run(level, false).pack).dynamic;
    std::string fitted(quick_profile);
    fitted.insert(fitted.find('{') + 1, fmt::format(R"("budgets": {{"dynamic": {}}}, )", whole * 7 / 10));
    SilentProgress silent;
    const auto cookFitted = [&] {
        const CookOptions options{.level = writeLevel(folder, level),
                                  .pack = folder.path / "fitted.dimmer",
                                  .profile = writeText(folder, "fitted.json", fitted).string(),
                                  .quality = "draft",
                                  .cache = folder.path / "cache",
                                  .fit = true};
        return cook(options, silent);
    };
    ASSERT_TRUE(cookFitted());
    for (json& node : level.document["nodes"])
        if (node.value("name", "") == "lamp3") node["translation"][0] = 8.7;
    const auto again = cookFitted();
    ASSERT_TRUE(again) << again.error().message;
    std::set<std::string> made, all;
    for (const CacheLine& line : again->stats.cache) {
        EXPECT_EQ(line.why.find("threshold"), std::string::npos) << line.what << ": " << line.why;
        all.insert(line.what);
        if (!line.reused) made.insert(line.what);
    }
    EXPECT_TRUE(made.contains("light set 'two'"));
    EXPECT_TRUE(all.contains("fit round 2: light set 'two'"));
}

TEST_F(CachedCook, KnowsAPackByItsPlaceHoweverItIsNamed) {
    const auto before = std::filesystem::current_path();
    std::filesystem::current_path(folder.path);
    SilentProgress silent;
    const CookOptions options{.level = writeLevel(folder, houseOfTwo()),
                              .pack = "here.dimmer",  // not there yet, then there
                              .profile = profile,
                              .quality = "draft",
                              .cache = folder.path / "cache"};
    cook(options, silent);
    LevelFile brighter = houseOfTwo();
    lamp(brighter, 1)["intensity"] = 50;
    writeLevel(folder, brighter);
    const auto again = cook(options, silent);
    std::filesystem::current_path(before);
    ASSERT_TRUE(again.has_value()) << again.error().message;
    for (const CacheLine& line : again->stats.cache) EXPECT_NE(line.why, "first cook of this pack here") << line.what;
}

TEST_F(CachedCook, AFolderThatTakesNothingIsAWarning) {
    writeText(folder, "cache", "a file where the folder should be");
    const CookResult result = run(houseOfTwo(), true);
    EXPECT_THAT(result.stats.warnings, testing::Contains(HasSubstr("cooked without a cache")));
    EXPECT_GT(bytes("level.dimmer").size(), 1000u);
}

TEST_F(CachedCook, TwoAtOnce) {
    const LevelFile level = houseOfTwo();
    const auto file = writeLevel(folder, level);
    std::atomic<int> done = 0;
    std::vector<std::thread> threads;
    for (const char* name : {"a.dimmer", "b.dimmer", "c.dimmer"})
        threads.emplace_back([&, name] {
            SilentProgress silent;
            done += cook({.level = file,
                          .pack = folder.path / name,
                          .profile = profile,
                          .quality = "draft",
                          .cache = folder.path / "cache"},
                         silent)
                        .has_value();
        });
    for (std::thread& t : threads) t.join();
    EXPECT_EQ(done, 3);
    EXPECT_TRUE(bytes("a.dimmer") == bytes("b.dimmer"));
    EXPECT_TRUE(bytes("a.dimmer") == bytes("c.dimmer"));
    EXPECT_THAT(made(level), IsEmpty());
}

TEST_F(CachedCook, WarnsOfModelsWhoseLightIsAllThere) {
    LevelFile level = houseOfTwo();
    for (json& node : level.document["nodes"])
        if (node.value("name", "") == "shelf") node["extras"]["dimmer_grid_spacing"] = 0.05;
    json settings = json::parse(quick_profile);
    settings["grids"]["local_probes_max"] = 1000;
    writeText(folder, "quick.json", settings.dump());
    const auto warnings = run(level, true).stats.warnings;
    EXPECT_THAT(warnings, testing::Contains(HasSubstr("'shelf': of its")));
    lamp(level, 2)["intensity"] = 137.31;
    EXPECT_EQ(run(level, true).stats.warnings, warnings);
}

}  // namespace
}  // namespace dimmer::cook::test
