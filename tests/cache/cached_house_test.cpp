// The demo's house, with twelve sets, three doors, a sun and a sky: what is added up for one light group does not
// depend on which others are baked beside it, nor on which ends of rays are known already.
#include <bake/bake.h>
#include <charts/texels.h>
#include <pipeline/charted_level.h>
#include <pipeline/cook_settings.h>
#include <pipeline/small_level.h>

#include <cmath>
#include <cstring>
#include <fstream>

namespace dimmer::cook::test {
namespace {

struct CachedHouse : testing::Test {
    const TemporaryFolder folder;
    const std::filesystem::path levels = std::filesystem::path(DIMMER_SOURCE_DIR) / "game_sample/levels";
    json house = json::parse(std::ifstream(levels / "house.gltf"));
    std::vector<std::string> settings = {"lightmaps.texels_per_metre=3", "bake.draft.rays=64",
                                         "bake.draft.probe_sites=4"};

    CachedHouse() { std::filesystem::copy(levels / "house.bin", folder.path / "house.bin"); }

    // The pack's bytes.
    std::string cooked(bool with_cache) {
        SilentProgress silent;
        CookOptions options{.level = writeText(folder, "house.gltf", house.dump()),
                            .pack = folder.path / "house.dimmer",
                            .quality = "draft",
                            .set = settings};
        if (with_cache) options.cache = folder.path / "cache";
        const auto result = cook(options, silent);
        EXPECT_TRUE(result.has_value()) << result.error().message;
        std::ifstream file(options.pack, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    json& node(const char* name) {
        for (json& n : house["nodes"])
            if (n.value("name", "") == name) return n;
        throw std::out_of_range(name);
    }
};

TEST_F(CachedHouse, AMovedLampIsBakedAsBesideAllOthers) {
    cooked(true);
    for (const char* lamp : {"alarm_hall", "porch_wall"}) {
        json& x = node(lamp)["translation"][0];
        x = x.get<double>() + 0.05;
        EXPECT_TRUE(cooked(true) == cooked(false)) << lamp;
    }
}

// Apart from the sky, the sun is a group of its own: its light ends before that of others does, and comes through doors
// into rooms that the sky lights anyhow.
TEST_F(CachedHouse, ATurnedSunIsBakedAsBesideAllOthers) {
    settings = {"bake.draft.lamps_apart=8", "grids.global=off"};
    cooked(true);
    json& turn = node("sun")["rotation"];
    turn[0] = turn[0].get<double>() * 0.9;
    double squares = 0;
    for (const json& x : turn) squares += x.get<double>() * x.get<double>();
    for (json& x : turn) x = x.get<double>() / std::sqrt(squares);
    EXPECT_TRUE(cooked(true) == cooked(false));
}

template <class Entry>
void expectSameBits(const Sparse<Entry>& a, const Sparse<Entry>& b, const char* what) {
    ASSERT_EQ(a.rows(), b.rows()) << what;
    size_t others = 0, entries = 0;
    for (size_t i = 0; i < a.rows(); ++i) {
        const auto x = a.row(i), y = b.row(i);
        ASSERT_EQ(x.size(), y.size()) << what << ' ' << i;
        entries += x.size();
        for (size_t k = 0; k < x.size(); ++k) {
            ASSERT_EQ(x[k].term, y[k].term) << what << ' ' << i;
            others += std::memcmp(&x[k].light, &y[k].light, sizeof x[k].light) != 0;
        }
    }
    EXPECT_GT(entries, 0u) << what;
    EXPECT_EQ(others, 0u) << what << ", of " << entries;
}

// Sharper than packs, whose few bits hide most of what is added up in another order.
TEST(BakedHouse, PassesOfTheirOwnGiveTheSameBits) {
    const auto scene = importLevel(std::filesystem::path(DIMMER_SOURCE_DIR) / "game_sample/levels/house.gltf");
    ASSERT_TRUE(scene) << scene.error().message;
    auto profile = loadProfile("desktop");
    ASSERT_TRUE(profile) << profile.error().message;
    profile->texels_per_metre = 2;
    profile->draft.rays = 64;
    profile->draft.probe_sites = 4;
    ChartedLevel level(*scene, *profile);
    ASSERT_TRUE(level.chart(*profile));
    const Texels texels = sampleTexels(*level.rays, level.charts, profile->draft.samples_per_texel);
    BakeSettings settings = bakeSettings(*profile, profile->draft, level.scene);
    SilentProgress silent;
    const Baked together = bake(*level.rays, level.charts, texels, settings, silent);
    settings.per_set_passes = true;
    const Baked apart = bake(*level.rays, level.charts, texels, settings, silent);
    expectSameBits(together.light, apart.light, "texels");
    expectSameBits(together.grid.light, apart.grid.light, "probes");
}

}  // namespace
}  // namespace dimmer::cook::test
