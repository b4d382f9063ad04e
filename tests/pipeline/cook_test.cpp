// The whole cook: the same input gives the same bytes, and bad input gives none.
#include <app/process.h>
#include <gmock/gmock.h>
#include <pipeline/small_level.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

namespace dimmer::cook::test {
namespace {

constexpr const char* quick_profile = R"({"bake": {"draft":
    {"samples_per_texel": 2, "series_rays": 8, "rays": 32, "emitter_samples": 2, "bounces": 8}}})";

// The bytes of the pack that `cook` writes; empty, and the test fails, when it does not.
std::string cookBytes(const CookOptions& options) {
    SilentProgress silent;
    const auto result = cook(options, silent);
    EXPECT_TRUE(result.has_value()) << result.error().message;
    if (!result) return {};
    const std::string bytes = dimmer::test::readText(options.pack);
    EXPECT_EQ(bytes.size(), result->file_bytes);
    return bytes;
}

void expectSameBytesOnAnyNumberOfThreads(const std::filesystem::path& level, const std::string& profile,
                                         const TemporaryFolder& folder) {
    auto with = [&](uint32_t threads, const char* name) {
        return cookBytes(
            {.level = level, .pack = folder.path / name, .profile = profile, .quality = "draft", .threads = threads});
    };
    const std::string one = with(1, "one.dimmer");
    ASSERT_GT(one.size(), 1000u);
    EXPECT_TRUE(one == with(2, "two.dimmer"));
    EXPECT_TRUE(one == with(0, "all.dimmer"));
    EXPECT_TRUE(one == with(1, "again.dimmer"));
    ASSERT_TRUE(Pack::open(folder.path / "one.dimmer"));
}

TEST(Cook, SameBytesOnAnyNumberOfThreads) {
    const TemporaryFolder folder;
    const auto profile = writeText(folder, "quick.json", quick_profile);
    expectSameBytesOnAnyNumberOfThreads(writeLevel(folder, twoCells()), profile.string(), folder);
}

// With every shipped setting of a draft, the noise filter included.
TEST(CookHouse, SameBytesOnAnyNumberOfThreads) {
    const TemporaryFolder folder;
    const auto level = std::filesystem::path(DIMMER_SOURCE_DIR) / "game_sample/levels/house.gltf";
    expectSameBytesOnAnyNumberOfThreads(level, "desktop", folder);
}

// As their seconds do: a fit cooks again and again with the same statistics.
TEST(Cook, RaysOfEveryRoundCount) {
    const auto scene = twoCells().import();
    ASSERT_TRUE(scene) << scene.error().message;
    SilentProgress silent;
    CookStats stats;
    ASSERT_TRUE(cookScene(*scene, smallProfile(), "draft", silent, stats));
    const uint64_t once = stats.rays;
    ASSERT_GT(once, 0u);
    ASSERT_TRUE(cookScene(*scene, smallProfile(), "draft", silent, stats));
    EXPECT_EQ(stats.rays, 2 * once);
}

// 3^8 ways for eight doors, of each of 80 light sets: more contributions than a bake can tell apart.
TEST(Cook, SaysThatCombinationsMakeTooManyContributions) {
    LevelFile level = twoCells();
    for (int set = 0; set < 80; ++set) {
        const int lamp = level.addLight("lamp", {{"type", "point"}, {"intensity", 1}},
                                        {{"dimmer_light_set", "set" + std::to_string(set)}});
        level.node(lamp)["translation"] = {1, 1, 1};
    }
    const int white = addWhite(level);
    json names = json::array();
    for (int d = 0; d < 8; ++d) {
        const std::string door = "d" + std::to_string(d);
        level.addNode({{"name", door},
                       {"mesh", level.addSquareMesh(white)},
                       {"translation", {0.2 * d, 0.1, 0.1}},
                       {"scale", {0.1, 0.1, 0.1}},
                       {"extras", {{"dimmer_door", door}}}});
        names.push_back("door:" + door);
    }
    level.document["scenes"][0]["extras"]["dimmer_combinations"] = json::array({names});
    const auto pack = cookLevel(level);
    ASSERT_FALSE(pack);
    EXPECT_EQ(pack.error().code, ErrorCode::BadInput);
    // With the three sets of the level and always-on light 84 groups.
    EXPECT_THAT(pack.error().message, testing::HasSubstr(std::to_string(84 * 6561) + " contributions with its 83"));
    EXPECT_THAT(pack.error().message, testing::HasSubstr("Name fewer doors"));
}

// Names of files and folders are not part of a cook.
TEST(Cook, SameBytesFromAnotherFolder) {
    const TemporaryFolder here, there;
    std::string bytes[2];
    for (int i = 0; i < 2; ++i) {
        const TemporaryFolder& folder = i == 0 ? here : there;
        const auto profile = writeText(folder, "quick.json", quick_profile);
        bytes[i] = cookBytes({.level = writeLevel(folder, twoCells()),
                              .pack = folder.path / (i == 0 ? "a.dimmer" : "b.dimmer"),
                              .profile = profile.string(),
                              .quality = "draft"});
    }
    EXPECT_TRUE(bytes[0] == bytes[1]);
}

TEST(Cook, ThePackNamesWhatTheLevelNames) {
    LevelFile level = twoCells();
    level.addNode({{"name", "player_start"}, {"translation", {1, 1, 1}}});
    level.addNode({{"name", "leaf"},
                   {"mesh", addRoomMesh(level, {3, 0, 0}, 1, 0)},
                   {"extras", {{"dimmer_door", "both"}}}});  // doors have a name space of their own
    const auto data = cookLevel(level);
    ASSERT_TRUE(data.has_value()) << data.error().message;
    std::vector<std::string> names;
    for (const Element& e : data->elements) names.push_back(e.name);
    EXPECT_THAT(names, testing::ElementsAre("one", "both", "two", "both"));
    EXPECT_EQ(data->elements[3].kind, ElementKind::Door);
    ASSERT_EQ(data->viewpoints.size(), 1u);
    EXPECT_EQ(data->viewpoints[0].name, "player_start");
    int leaves = 0;
    for (const Mesh& mesh : data->meshes) leaves += mesh.door == 3u;
    EXPECT_EQ(leaves, 1);
    EXPECT_TRUE(validate(*data));
}

// Light of a closed room stays in it, whatever the exposure, the clusters and the encoding do to it.
TEST(Cook, ASetIsStoredOnlyWhereItShines) {
    const auto data = cookLevel(twoCells());
    ASSERT_TRUE(data.has_value()) << data.error().message;
    ASSERT_EQ(data->contributions.size(), 3u);  // one, both, two
    std::set<std::vector<uint32_t>> lists;
    for (const Cluster& c : data->clusters) {
        std::vector<uint32_t> list;
        for (uint32_t t = 0; t < c.term_count; ++t) list.push_back(data->terms[c.first_term + t].contribution);
        lists.insert(list);
        EXPECT_FALSE(std::ranges::find(list, 0u) != list.end() && std::ranges::find(list, 2u) != list.end());
    }
    EXPECT_TRUE(lists.contains({0, 1}));
    EXPECT_TRUE(lists.contains({1, 2}));
    // Every wall of a room sees both lamps: "both" lies wherever one of the others does.
    EXPECT_EQ(data->contributions[1].receivers, data->contributions[0].receivers + data->contributions[2].receivers);
}

TEST(Cook, BadInputWritesNothing) {
    const TemporaryFolder folder;
    const auto level = writeLevel(folder, twoCells());
    const auto broken = writeText(folder, "broken.gltf", "{}");
    const auto old = writeText(folder, "old.dimmer", "the old pack");
    SilentProgress silent;
    const std::vector<std::pair<CookOptions, ErrorCode>> cases = {
        {{.level = broken, .pack = old}, ErrorCode::BadInput},
        {{.level = folder.path / "none.gltf", .pack = old}, ErrorCode::Io},
        {{.level = level, .pack = old, .profile = "nobody"}, ErrorCode::NotFound},
        {{.level = level, .pack = old, .quality = "superb"}, ErrorCode::InvalidArgument},
    };
    for (const auto& [options, code] : cases) {
        const auto result = cook(options, silent);
        ASSERT_FALSE(result.has_value());
        EXPECT_EQ(result.error().code, code) << result.error().message;
        EXPECT_FALSE(result.error().message.empty());
    }
    EXPECT_EQ(dimmer::test::readText(old), "the old pack");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path), {}), 3);
}

TEST(Cook, ALevelWithoutLightIsNoMistake) {
    LevelFile level;
    level.addNode({{"name", "dark"}, {"mesh", addRoomMesh(level, {0, 0, 0}, 2, addWhite(level))}});
    const auto data = cookLevel(level);
    ASSERT_TRUE(data.has_value()) << data.error().message;
    EXPECT_TRUE(data->contributions.empty());
    EXPECT_TRUE(data->payload.empty());
    for (const TexelRecord& texel : data->base_pages) ASSERT_EQ(texel.irradiance, 0u);
    EXPECT_TRUE(validate(*data));
}

}  // namespace
}  // namespace dimmer::cook::test
