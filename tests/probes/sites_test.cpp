// Where probes may stand: how places are spread, and in which order they are looked at.
#include <bake/test_scenes.h>
#include <gtest/gtest.h>
#include <probes/sites.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook::test {
namespace {

TEST(Sites, AnyFirstPartIsSpreadOverAllBlocks) {
    const std::vector<SiteBlock> blocks = {{std::vector<glm::vec3>(1000), 1},
                                           {std::vector<glm::vec3>(100), 1},
                                           {{}, 1},
                                           {std::vector<glm::vec3>(10), 1},
                                           {std::vector<glm::vec3>(3), 1}};
    const std::vector<SiteRow> order = siteOrder(blocks);
    ASSERT_EQ(order.size(), 1113u);
    std::vector<size_t> seen(blocks.size());
    for (size_t i = 0; i < order.size(); ++i) {
        EXPECT_EQ(order[i].row, seen[order[i].block]++);  // every row once, in its block's order
        if (i >= 1110) {
            EXPECT_EQ(order[i].block, 4u);  // the corners
            continue;
        }
        // Each of the three is within half a place of the same share, so their sum within 1.5, and each within 2 of it.
        for (size_t b = 0; b < 4; ++b)
            EXPECT_NEAR(static_cast<double>(seen[b]), static_cast<double>(blocks[b].places_m.size() * (i + 1)) / 1110,
                        2)
                << i << " " << b;
    }
    EXPECT_TRUE(siteOrder({}).empty());
}

TEST(Sites, ManyLampsDoNotComeBeforeTheRest) {
    std::vector<SiteBlock> blocks(202, {std::vector<glm::vec3>(5), 1});
    blocks[0].places_m.resize(1000);
    const std::vector<SiteRow> order = siteOrder(blocks);
    for (size_t i = 0; i < 100; ++i) EXPECT_EQ(order[i].block, 0u) << i;
}

// Less than one of 8,192 places of its box is in the open: of the first look, none. The lamp's own are.
TEST(Sites, ASmallRoomInAVastLevelStillHasSome) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {2, 2, 2}, grey);
    addQuad(scene, "far away", {300, 300, 300}, {0, 1, 0}, {0, 0, 1}, grey);  // all see its back
    scene.lights.emplace_back().position_m = {0, 1, 0};
    const auto choice = chooseSites(RayScene(scene), {.probes_max = 100, .sites = 8}, nullptr);
    ASSERT_TRUE(choice);
    ASSERT_EQ(choice->blocks.size(), 4u);
    EXPECT_GT(choice->blocks[2].places_m.size(), 50u);
}

// A hall of 24 m each way with a probe for each 8 m3, and so near its walls within 1.6 m. At distance d from them lie
// 24 (12 - d)^2 m2. Rays see walls up to a tenth too far, which takes a tenth of what is far away at most.
TEST(Sites, StandMoreCloselyNearSurfaces) {
    Scene scene;
    addBox(scene, {12, 12, 12}, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    const auto far_share = [&](bool uniform) {
        const auto choice = chooseSites(rays, {.probes_max = 1728, .sites = 8, .uniform = uniform}, nullptr);
        EXPECT_TRUE(choice);
        const std::vector<glm::vec3>& places = choice->blocks[0].places_m;
        EXPECT_EQ(places.size(), uniform ? 13824u : 11060u);  // a fifth of them at surfaces
        const auto far = std::ranges::count_if(places, [](glm::vec3 p) {
            return 12 - std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > 2;
        });
        return static_cast<double>(far) / static_cast<double>(places.size());
    };
    EXPECT_NEAR(far_share(true), std::pow(10.0 / 12, 3), 0.013);  // three standard errors
    constexpr double near_m = 1.6;
    const double near_walls = (std::pow(12, 3) - std::pow(12 - near_m, 3)) / 3;
    const auto thinned = [](double d) { return near_m * (144 * std::log(d) - 24 * d + d * d / 2); };
    const double between = thinned(2) - thinned(near_m), beyond = thinned(12) - thinned(2);
    const double expected = beyond / (near_walls + between + beyond);  // of (12 - d)^2 min(1, near / d)
    EXPECT_LT(far_share(false), expected + 0.015);
    EXPECT_GT(far_share(false), expected * 0.9 - 0.015);
}

// Of a room, however it stands: a third at one of its surfaces, a third along an edge, a third in a corner, all as near
// as things stand there and no nearer than probes may.
TEST(Sites, AFifthLieAtSurfacesEdgesAndCorners) {
    for (const float angle : {0.0f, 0.5f}) {
        const glm::vec3 u(std::cos(angle), 0, std::sin(angle)), v(0, 1, 0), w = glm::cross(u, v);
        Scene scene;
        addBox(scene, {6, 2, 4}, addMaterial(scene, lambert(0.5f)));
        for (SceneMesh& mesh : scene.meshes)
            for (glm::vec3& p : mesh.positions_m) p = p.x * u + p.y * v + p.z * w;
        const auto choice = chooseSites(RayScene(scene), {.probes_max = 300, .sites = 16}, nullptr);
        ASSERT_TRUE(choice);
        const std::vector<glm::vec3>& places = choice->blocks[1].places_m;
        EXPECT_EQ(places.size(), (choice->blocks[0].places_m.size() + places.size()) / 5);
        std::array<size_t, 4> at{};  // per number of surfaces
        for (const glm::vec3 p : places) {
            const glm::vec3 off_m =
                glm::vec3(6, 2, 4) - glm::abs(glm::vec3(glm::dot(p, u), glm::dot(p, v), glm::dot(p, w)));
            size_t surfaces = 0;
            for (int c = 0; c < 3; ++c) {
                EXPECT_GT(off_m[c], 0.045f);  // 5 cm, but rays see walls up to a tenth too far
                surfaces += off_m[c] < 0.0851f;
            }
            ++at[surfaces];
        }
        // Some of those for one surface happen to lie near another as well; where ways graze, places stay away.
        for (const size_t surfaces : {1, 2, 3})
            EXPECT_NEAR(static_cast<double>(at[surfaces]), static_cast<double>(places.size()) / 3,
                        0.06 * static_cast<double>(places.size()))
                << surfaces << " at " << angle;
    }
}

// Heights of places follow from the last digits of their numbers, what they are for must not.
TEST(Sites, EveryStoreyHasSurfacesEdgesAndCorners) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    for (const float height_m : {-3.0f, 0.0f, 3.0f}) {
        const size_t first = scene.meshes.size();
        addBox(scene, {3, 1.3f, 3}, grey);
        for (size_t m = first; m < scene.meshes.size(); ++m)
            for (glm::vec3& p : scene.meshes[m].positions_m) p.y += height_m;
    }
    const auto choice = chooseSites(RayScene(scene), {.probes_max = 300, .sites = 16}, nullptr);
    ASSERT_TRUE(choice);
    std::array<std::array<double, 4>, 3> at{};  // per storey and number of surfaces
    for (glm::vec3 p : choice->blocks[1].places_m) {
        const auto storey = static_cast<size_t>(std::clamp(std::floor((p.y + 4.5f) / 3), 0.0f, 2.0f));
        p.y -= 3 * (static_cast<float>(storey) - 1);
        const glm::vec3 off_m = glm::vec3(3, 1.3f, 3) - glm::abs(p);
        const int surfaces = (off_m.x < 0.0851f) + (off_m.y < 0.0851f) + (off_m.z < 0.0851f);
        ++at[storey][static_cast<size_t>(surfaces)];
    }
    for (const auto& storey : at)
        for (const size_t surfaces : {1, 2, 3})  // some hundred places of each: 8 % by chance
            EXPECT_NEAR(storey[surfaces], (storey[1] + storey[2] + storey[3]) / 3,
                        0.2 * (storey[1] + storey[2] + storey[3]) / 3);
}

TEST(Sites, ProbesPerCubicMetreAreWhatIsAskedFor) {
    Scene scene;
    addBox(scene, {2, 1.5f, 2}, addMaterial(scene, lambert(0.5f)));  // 48 m3, less 5 cm along the walls
    const RayScene rays(scene);
    const auto probes = [&](float per_m3, uint32_t most = 20000) {
        const auto choice = chooseSites(rays, {.probes_max = most, .probes_per_m3 = per_m3, .sites = 4}, nullptr);
        return static_cast<double>(choice->probes_max + 8) / choice->free_volume_m3;
    };
    EXPECT_NEAR(probes(1), 1, 0.03);
    EXPECT_NEAR(probes(8), 8, 0.03);
    EXPECT_NEAR(probes(0), 4 + 32 / 42.5, 0.1);  // so small a level
    EXPECT_LT(probes(8, 60), 2);
}

// A set that can be off counts a twentieth of what never is; bright or dim, as all count by their own mean; and taken
// apart, lamp by lamp, together what it counts as a whole.
TEST(Sites, PlacementSeesSetsAsATwentiethOfWhatIsAlwaysOn) {
    Scene scene;
    scene.light_sets = {{.name = "bulbs"},
                        {.name = "hall, lamp a", .part_of = "hall"},
                        {.name = "hall, lamp b", .part_of = "hall"},
                        {.name = "always-on light, lamp sun", .always_on = true}};
    const std::vector<Term> terms = {{0, {}, {}}, {1, {}, {}}, {2, {}, {}}, {3, {}, {}}, {4, {}, {}}};
    ProbeLight dim, bright;
    dim.radiance[0] = glm::vec3(0.1f);
    bright.radiance[0] = glm::vec3(50);
    Sparse<ProbeTermLight>::Builder rows(1);
    rows.put(0, std::vector<ProbeTermLight>{
                    {0, dim, 0, 0}, {1, bright, 0, 0}, {2, bright, 0, 0}, {3, dim, 0, 0}, {4, bright, 0, 0}});
    const std::vector<FitValue> states = statesOf(scene, rows.finish(), terms, std::vector<SiteRow>{{0, 0}});
    // The first set is of one half, the second of the other, with what is always on.
    const float all = states[0][0], always_and_hall = states[0][9], bulbs = states[0][18];
    EXPECT_NEAR(always_and_hall / bulbs, (1 + 0.05f) / 0.05f, 1e-3);
    EXPECT_NEAR(all, always_and_hall + bulbs, 1e-6 * all);
}

// All light is seen with the doors open, or a room that is lit through one would get hardly a probe; halves of the sets
// with the doors closed.
TEST(Sites, PlacementSeesDoorsOpenAndClosed) {
    const std::vector<Term> terms = {{0, {}, {}}, {0, {1}, {}}, {0, {}, {1}}, {0, {1}, {0}}};
    std::vector<ProbeTermLight> row(4);
    for (uint32_t t = 0; t < 4; ++t) {
        row[t].term = t;
        row[t].light.radiance[0] = glm::vec3(std::pow(10.0f, static_cast<float>(t)));
    }
    Sparse<ProbeTermLight>::Builder rows(1);
    rows.put(0, row);
    const FitValue states = statesOf({}, rows.finish(), terms, std::vector<SiteRow>{{0, 0}})[0];
    EXPECT_NEAR(states[0] / states[9], (1 + 10) / (1.0 + 100), 1e-6);  // free and open; free and closed
}

}  // namespace
}  // namespace dimmer::cook::test
