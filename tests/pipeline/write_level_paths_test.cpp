// What a written level names beside itself is found from where it really is.
#include <gmock/gmock.h>
#include <pipeline/small_level.h>
#include <pipeline/write_level.h>

#include <cstring>
#include <fstream>

namespace dimmer::cook::test {
namespace {

namespace fs = std::filesystem;

json documentOf(const fs::path& glb) {
    std::ifstream in(glb, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    uint32_t length = 0;  // of the JSON, behind the file's header of 12 bytes
    if (bytes.size() < 20) return {};
    std::memcpy(&length, bytes.data() + 12, sizeof(length));
    return json::parse(bytes.substr(20, length));
}

// The key of a GLB file's first scene.
std::string skyNamedBy(const fs::path& glb) {
    json document = documentOf(glb);
    return document["scenes"][0]["extras"].value("dimmer_sky_image", "");
}

Expected<CookResult> cookedQuickly(const TemporaryFolder& folder, const fs::path& source) {
    const auto profile = writeText(folder, "quick.json", R"({"bake": {"draft": {"samples_per_texel": 1,
        "series_rays": 4, "rays": 4, "emitter_samples": 1}}})");
    SilentProgress silent;
    return cook({.level = source, .pack = folder.path / "a.dimmer", .profile = profile.string(), .quality = "draft"},
                silent);
}

// A photometric file is named by a URI, whose escapes a folder's name may look like.
TEST(WriteLevelPaths, FoldersThatLookLikeEscapesNameTheSameProfile) {
    const TemporaryFolder folder;
    for (const char* name : {"50%41", "out"}) fs::create_directory(folder.path / name);
    writeText(folder, "50%41/l amp.ies",
              "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 1 1 2 0 0 0\n1 1 0\n0 90\n0\n100 100\n");
    LevelFile level = twoCells();
    level.document["extensionsUsed"].push_back("EXT_lights_ies");
    level.document["extensions"]["EXT_lights_ies"]["lights"] = json::array({{{"uri", "l%20amp.ies"}}});
    level.addNode({{"name", "spot"}, {"extensions", {{"EXT_lights_ies", {{"light", 0}}}}}});
    const auto source = writeLevel(folder, level, "50%41/level.gltf");
    const auto cooked = cookedQuickly(folder, source);
    ASSERT_TRUE(cooked.has_value()) << cooked.error().message;
    std::vector<std::string> warnings;
    const auto written = folder.path / "out/level.glb";
    ASSERT_TRUE(cook::writeLevel(source, cooked->pack, written, warnings));
    json document = documentOf(written);
    EXPECT_EQ(document["extensions"]["EXT_lights_ies"]["lights"][0]["uri"], "../50%2541/l%20amp.ies");
    EXPECT_TRUE(importLevel(written));
}

TEST(WriteLevelPaths, ThroughLinksAndDotsNameTheSameSky) {
    const TemporaryFolder folder;
    for (const char* name : {"levels", "out", "far", "far/deep"}) fs::create_directory(folder.path / name);
    fs::create_directory_symlink("far/deep", folder.path / "link");
    fs::create_directory_symlink("../levels", folder.path / "out/same");
    fs::create_symlink("../far/deep/named.glb", folder.path / "levels/alias.glb");
    const auto sky = writeText(folder, "levels/sky.hdr",
                               "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + std::string(8, '\x80'));
    LevelFile level = twoCells();
    level.document["scenes"][0]["extras"] = {{"dimmer_sky_image", "sky.hdr"}};
    const auto source = writeLevel(folder, level, "levels/level.gltf");
    const auto cooked = cookedQuickly(folder, source);
    ASSERT_TRUE(cooked.has_value()) << cooked.error().message;
    const auto expectFound = [&](const fs::path& from, const fs::path& to, const fs::path& real) {
        std::vector<std::string> warnings;
        const auto ok = cook::writeLevel(folder.path / from, cooked->pack, folder.path / to, warnings);
        ASSERT_TRUE(ok) << to << ok.error().message;
        ASSERT_TRUE(fs::is_regular_file(folder.path / real)) << to;
        const fs::path named = skyNamedBy(folder.path / real);
        EXPECT_EQ(named.is_relative(), !fs::is_symlink(folder.path / to)) << to << named;
        for (const fs::path& opened : {folder.path / real, folder.path / to}) {
            const fs::path found = opened.parent_path() / named;
            EXPECT_TRUE(fs::exists(found) && fs::equivalent(found, sky)) << opened << named;
        }
    };
    expectFound("levels/level.gltf", "levels/beside.glb", "levels/beside.glb");
    expectFound("levels/level.gltf", "levels/../out/a.glb", "out/a.glb");
    expectFound("out/../levels/level.gltf", "out/b.glb", "out/b.glb");
    expectFound("levels/level.gltf", "link/c.glb", "far/deep/c.glb");
    expectFound("levels/level.gltf", "link/../d.glb", "far/d.glb");
    expectFound("levels/level.gltf", "levels/alias.glb", "far/deep/named.glb");
    expectFound("out/same/level.gltf", "out/e.glb", "out/e.glb");
}

}  // namespace
}  // namespace dimmer::cook::test
