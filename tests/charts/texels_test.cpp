// Where the sample points of texels lie.
#include <bake/test_scenes.h>
#include <charts/pages.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <gtest/gtest.h>
#include <scene/open_pose.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ranges>
#include <set>

namespace dimmer::cook::test {
namespace {

// A point of a face's plane in texels of its page: the face's own map from corners to texels, carried on linearly.
glm::dvec2 texelsOf(const RayScene& rays, const Unwrap& charts, const SamplePoint& sample) {
    const uint32_t triangle = charts.faces[sample.face].triangle;
    const auto& uv = charts.uv_texels[sample.face];
    const glm::dvec3 a = rays.corner(triangle, 0), ab = glm::dvec3(rays.corner(triangle, 1)) - a,
                     ac = glm::dvec3(rays.corner(triangle, 2)) - a, ap = glm::dvec3(sample.position_m) - a;
    const glm::dvec3 normal = glm::cross(ab, ac);
    const double area = glm::dot(normal, normal);
    const double v = glm::dot(glm::cross(ap, ac), normal) / area, w = glm::dot(glm::cross(ab, ap), normal) / area;
    return (1 - v - w) * glm::dvec2(uv[0]) + v * glm::dvec2(uv[1]) + w * glm::dvec2(uv[2]);
}

// Pages are looked up at texels' centres: points that lean to one side would shift the light by as much.
TEST(Texels, PointsBalanceAroundTheCentre) {
    Scene scene;
    addFloor(scene, 2, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(charts.has_value());
    for (const uint32_t count : {1u, 2u, 3u, 4u, 5u, 8u, 13u, 16u, 64u}) {
        const Texels texels = sampleTexels(rays, *charts, count);
        size_t whole = 0;
        for (size_t i = 0; i < texels.size(); ++i) {
            if (texels.area_m2[i] < 0.0624f) continue;  // of 0.0625: a texel on the border
            ++whole;
            ASSERT_EQ(texels.sampleCount(i), count);
            glm::dvec2 sum(0);
            for (uint32_t s = 0; s < count; ++s)
                sum += texelsOf(rays, *charts, samplePoint(rays, *charts, texels, i, s));
            const glm::dvec2 centre = glm::floor(sum / static_cast<double>(count)) + 0.5;
            // Floats of metres over texels of 0.25 m leave 1e-5 texels; Halton points as they come lie up to 0.17 off.
            EXPECT_NEAR(sum.x / count, centre.x, 1e-4) << count;
            EXPECT_NEAR(sum.y / count, centre.y, 1e-4) << count;
        }
        EXPECT_GT(whole, 200u);
    }
}

// Where a wall's skin cuts a chart, the texel's edge lies in the skin: a point there is of either side.
TEST(Texels, PointsLieOffTheEdge) {
    Scene scene;
    addFloor(scene, 2, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(charts.has_value());
    for (const uint32_t count : {1u, 4u, 5u, 6u, 8u, 64u}) {
        const Texels texels = sampleTexels(rays, *charts, count);
        for (const TexelPoint& p : texels.samples) {
            const auto least = static_cast<uint32_t>(std::min(p.x, p.y)), most = uint32_t{std::max(p.x, p.y)};
            ASSERT_GE(least, TexelPoint::steps / 256) << count;
            ASSERT_LE(most, TexelPoint::steps - TexelPoint::steps / 256) << count;
        }
    }
}

// Receivers among a mesh's texels, by whether a point is in a part of the plane.
size_t receiversWhere(const RayScene& rays, const Unwrap& charts, const Texels& texels, const char* mesh, auto&& in) {
    return static_cast<size_t>(std::ranges::count_if(std::views::iota(size_t{0}, texels.size()), [&](size_t i) {
        const uint32_t triangle = charts.faces[texels.face(i)].triangle;
        return rays.scene().meshes[rays.triangles()[triangle].mesh].node == mesh &&
               in(samplePoint(rays, charts, texels, i, 0).position_m);
    }));
}

// Backs are most of what is seen below a roof that has one side, which looks up. It is no solid's inside.
TEST(Texels, OfAHallBelowABackAreLit) {
    for (const bool walls : {false, true}) {
        Scene scene;
        const uint32_t grey = addMaterial(scene, lambert(0.5f));
        addFloor(scene, 5, grey);
        addFloor(scene, 5, grey, 3).node = "roof";
        if (walls)
            for (const float side : {-1.0f, 1.0f}) {
                addQuad(scene, "wall", {side * 5, 1.5f, 0}, {0, 1.5f, 0}, {0, 0, -side * 5}, grey);
                addQuad(scene, "wall", {0, 1.5f, side * 5}, {0, 1.5f, 0}, {side * 5, 0, 0}, grey);
            }
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        const Texels texels = sampleTexels(rays, *charts, 4);
        EXPECT_GE(receiversWhere(rays, *charts, texels, "floor", [](glm::vec3) { return true; }), 40u * 40u) << walls;
    }
}

// What furniture hides gets no light, with or without its hidden sides, and is no receiver, a texel away from these.
TEST(Texels, OfAFloorBelowFurnitureAreNone) {
    for (const bool closed : {false, true}) {
        Scene scene;
        const uint32_t grey = addMaterial(scene, lambert(0.5f));
        addQuad(scene, "floor", {2, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);
        addQuad(scene, "wall", {-2, 1.5f, 0}, {0, 1.5f, 0}, {0, 0, 4}, grey);
        addSolid(scene, "cupboard", {-1.5f, 1, 0}, {0.5f, 1, 1}, grey);
        if (!closed)
            std::erase_if(scene.meshes, [](const SceneMesh& m) {
                return m.node == "cupboard" && (m.normals[0].y < -0.5f || m.normals[0].x < -0.5f);
            });
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        const Texels texels = sampleTexels(rays, *charts, 4);
        const auto within = [](glm::vec3 p) { return std::abs(p.x + 1.5f) < 0.25f && std::abs(p.z) < 0.75f; };
        EXPECT_EQ(receiversWhere(rays, *charts, texels, "floor", within), 0u) << closed;
    }
}

// Points are lifted off the floor by more than paper lies over it: below the paper nothing is lit for all that. In the
// floor's own plane it may be the floor itself, in pieces that differ by rounding.
TEST(Texels, OfAFloorUnderPaperAreNone) {
    for (const float height_m : {1e-4f, 3.5e-4f}) {
        Scene scene;
        addFloor(scene, 1, addMaterial(scene, lambert(0.5f)));
        Material both = lambert(0.5f);
        both.double_sided = true;
        addFloor(scene, 0.5f, addMaterial(scene, std::move(both)), height_m).node = "paper";
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        const Texels texels = sampleTexels(rays, *charts, 4);
        const auto within = [](glm::vec3 p) { return std::abs(p.x) < 0.4f && std::abs(p.z) < 0.4f; };
        const size_t below = receiversWhere(rays, *charts, texels, "floor", within);
        EXPECT_EQ(below > 0, height_m < 3e-4f) << height_m;
    }
}

// About the vertical, as a level that is not along the axes: its planes differ by rounding.
void turn(Scene& scene, float angle) {
    const auto turned = [&](glm::vec3 p) {
        return glm::vec3(std::cos(angle) * p.x + std::sin(angle) * p.z, p.y,
                         std::cos(angle) * p.z - std::sin(angle) * p.x);
    };
    for (SceneMesh& mesh : scene.meshes) {
        for (glm::vec3& p : mesh.positions_m) p = turned(p);
        for (glm::vec3& n : mesh.normals) n = turned(n);
    }
}

// Where floor and roof meet at an acute angle a point over the one may lie beyond the other, in the sun: along the
// eaves of a sealed attic tens of thousands of lux. However little of a texel is there: turned, faces that are whole
// texels long reach into the next by rounding.
TEST(Texels, AtEavesLieBelowTheRoof) {
    constexpr float degree = 0.0174533f;
    for (const float angle : {0.0f, 0.1f, 0.3f}) {
        size_t near_eaves = 0;
        for (int n = 0; n < 40; ++n) {
            const float half = 3 + 0.005f * static_cast<float>(n),
                        slope = (10 + 10 * static_cast<float>(n % 4)) * degree;
            Scene scene;
            addAttic(scene, half, 2, slope, addMaterial(scene, lambert(0.5f)));
            turn(scene, angle);
            const RayScene rays(scene);
            const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
            ASSERT_TRUE(charts.has_value());
            const Texels texels = sampleTexels(rays, *charts, 8);
            for (size_t i = 0; i < texels.size(); ++i)
                for (uint32_t s = 0; s < texels.sampleCount(i); ++s) {
                    const glm::vec3 p = samplePoint(rays, *charts, texels, i, s).position_m;
                    const float room = half - std::abs(std::cos(angle) * p.x - std::sin(angle) * p.z);
                    near_eaves += room < 0.02f;
                    // Between floor and slope, but for rounding at 3 m.
                    ASSERT_LT(p.y, room * std::tan(slope) + 2e-6f) << half << ", turned by " << angle;
                    ASSERT_GT(p.y, -2e-6f) << half << ", turned by " << angle;
                }
        }
        EXPECT_GT(near_eaves, 1000u);
    }
}

// Stairs of boxes, each as high as its step and touching the next: all around a point in one of them lies the back of
// it and, in the same place, the front of another. Risers were black where a texel holds more of the hidden part.
// A decal's back is all that a floor 1 cm below it sees: where it lets light by the floor is lit, and none of its
// points are inside of anything. (Of an opaque one, a lid without sides, it is not.)
TEST(Texels, BelowADecalAreLit) {
    for (const AlphaMode mode : {AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Mask}) {
        Scene scene;
        addFloor(scene, 1, addMaterial(scene, lambert(0.5f)));
        Material sheet = lambert(0.5f);
        sheet.alpha_mode = mode;
        sheet.alpha = 0.5f;
        addQuad(scene, "decal", {0, 0.01f, 0}, {0, 0, 1}, {1, 0, 0}, addMaterial(scene, std::move(sheet)));
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 64});
        ASSERT_TRUE(charts.has_value());
        const Texels texels = sampleTexels(rays, *charts, 8);
        size_t below = 0;
        for (size_t i = 0; i < texels.size(); ++i)
            for (uint32_t s = 0; s < texels.sampleCount(i); ++s)
                below += samplePoint(rays, *charts, texels, i, s).position_m.y < 0.005f;
        if (mode == AlphaMode::Opaque)
            EXPECT_LT(below, 64u);
        else
            EXPECT_EQ(below, 8u * 64);
    }
}

// A trapdoor's leaf 1 cm over a floor of texels of 25 cm, from x = -0.1 on. Where it stops within a texel no point is
// behind it; further in, where a texel has no other points, all are, as the open door uncovers them.
TEST(Texels, BesideALeafAreNotBehindIt) {
    for (const bool open_pose : {false, true}) {
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        addFloor(scene, 1, white);
        scene.doors.push_back({.name = "trap", .pose = open_pose});
        SceneMesh& leaf = addQuad(scene, "leaf", {0.45f, 0.01f, 0}, {0.55f, 0, 0}, {0, 0, 1}, white);  // its lower side
        leaf.door = 0;
        // Open, it slides aside by half: what it covers in both states, and what in one.
        if (open_pose) leaf.open_from_closed[3] = glm::dvec4(-0.5, 0, 0, 1);
        if (open_pose) addOpenLeaves(scene);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 64});
        ASSERT_TRUE(charts.has_value());
        const Texels texels = sampleTexels(rays, *charts, 8);
        size_t floors = 0;
        for (size_t i = 0; i < texels.size(); ++i) {
            const auto pointAt = [&](uint32_t s) { return samplePoint(rays, *charts, texels, i, s).position_m; };
            if (charts->frames[samplePoint(rays, *charts, texels, i, 0).face].normal.y < 0) continue;  // of the leaf
            ++floors;
            EXPECT_EQ(texels.sampleCount(i), 8u);
            const float begin_m = std::floor(pointAt(0).x * 4) / 4;  // of the texel
            for (uint32_t s = 0; s < texels.sampleCount(i); ++s) {
                const float x = pointAt(s).x;
                // Closed it covers -0.1 .. 1, open -0.6 .. 0.5.
                const bool stops_here = begin_m == -0.25f || (open_pose && begin_m == -0.75f);
                const float edge_m = begin_m == -0.75f ? -0.6f : -0.1f;
                EXPECT_TRUE(!stops_here || x < edge_m) << x;
            }
        }
        EXPECT_EQ(floors, 64u);
    }
}

TEST(Texels, OfStepsThatTouchSeeTheRoom) {
    for (const float angle : {0.0f, 0.12f})
        for (const float texels_per_metre : {2.0f, 4.0f}) {
            Scene scene;
            const uint32_t grey = addMaterial(scene, lambert(0.5f));
            constexpr float rise = 0.18f, run = 0.28f;
            constexpr int steps = 12;
            addQuad(scene, "floor", {0, 0, 0}, {0, 0, 4}, {6, 0, 0}, grey);
            addQuad(scene, "wall", {0, 1.5f, -0.6f}, {6, 0, 0}, {0, 1.5f, 0}, grey);
            for (int i = 0; i < steps; ++i)
                addSolid(scene, i < 10 ? "step" : "top",
                         {run * (static_cast<float>(i) + 0.5f), rise * 0.5f * static_cast<float>(i + 1), 0},
                         {run / 2, rise * 0.5f * static_cast<float>(i + 1), 0.6f}, grey);
            turn(scene, angle);
            const RayScene rays(scene);
            const auto charts = unwrap(rays, {.texels_per_metre = texels_per_metre, .page_size = 512});
            ASSERT_TRUE(charts.has_value());
            const Texels texels = sampleTexels(rays, *charts, 4);
            const glm::vec3 forth(-std::cos(angle), 0, std::sin(angle));  // risers face there
            std::set<int> risers;
            for (size_t i = 0; i < texels.size(); ++i) {
                const SamplePoint p = samplePoint(rays, *charts, texels, i, 0);
                if (glm::dot(charts->frames[p.face].normal, forth) < 0.9f) continue;
                if (rays.scene().meshes[rays.triangles()[charts->faces[p.face].triangle].mesh].node == "wall") continue;
                const int step = static_cast<int>(std::lround(-glm::dot(p.position_m, forth) / run));
                for (uint32_t s = 0; s < texels.sampleCount(i); ++s) {
                    const float y = samplePoint(rays, *charts, texels, i, s).position_m.y;
                    EXPECT_GT(y, rise * static_cast<float>(step) - 1e-3f) << step << " of " << angle;
                }
                risers.insert(step);
            }
            EXPECT_EQ(risers.size(), size_t{steps}) << angle << " " << texels_per_metre;
        }
}

// A room between six others, all inward boxes that share their planes: nothing tells it from a solid between solids but
// that no back is seen alone. It is a room.
TEST(Texels, OfRoomsWithoutWallsThicknessAreLit) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    const auto addRoomAt = [&](glm::vec3 centre, const char* node) {
        const size_t first = scene.meshes.size();
        addBox(scene, glm::vec3(1.5f), grey);
        for (size_t m = first; m < scene.meshes.size(); ++m) {
            scene.meshes[m].node = node;
            for (glm::vec3& p : scene.meshes[m].positions_m) p += centre;
        }
    };
    addRoomAt({0, 0, 0}, "middle");
    for (int axis = 0; axis < 3; ++axis)
        for (const float side : {-3.0f, 3.0f}) {
            glm::vec3 centre(0);
            centre[axis] = side;
            addRoomAt(centre, "other");
        }
    turn(scene, 0.3f);
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 512});
    ASSERT_TRUE(charts.has_value());
    const Texels texels = sampleTexels(rays, *charts, 4);
    EXPECT_GE(receiversWhere(rays, *charts, texels, "middle", [](glm::vec3) { return true; }), 6u * 12u * 12u);
}

// Pages mix what lies far apart: a bake goes from place to place all the same, and each is one run of receivers.
TEST(Texels, StandInTheOrderOfSpace) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    for (const float y : {0.0f, 1.0f, 2.0f})
        for (const float x : {40.0f, -40.0f}) addQuad(scene, "floor", {x, y, 0}, {0, 0, 2}, {2, 0, 0}, white);
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(charts.has_value());
    const Texels texels = sampleTexels(rays, *charts, 1);
    ASSERT_GT(texels.size(), 6u * 100);
    size_t page_runs = 1, runs = 1;
    std::vector<std::pair<uint32_t, bool>> by_page;
    const auto isLeft = [&](size_t i) { return samplePoint(rays, *charts, texels, i, 0).position_m.x < 0; };
    for (size_t i = 0; i < texels.size(); ++i) by_page.emplace_back(texels.address[i], isLeft(i));
    for (size_t i = 1; i < texels.size(); ++i) runs += by_page[i].second != by_page[i - 1].second;
    std::ranges::sort(by_page);
    for (size_t i = 1; i < by_page.size(); ++i) page_runs += by_page[i].second != by_page[i - 1].second;
    EXPECT_EQ(runs, 2u);
    EXPECT_GT(page_runs, 4u);  // else the level says nothing
}

// A rug of the floor's outline, 3 mm over it: no texel is of both, and the rug's are whole.
TEST(Texels, OfAThinRugAreNotTheFloors) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addFloor(scene, 1, white);
    addFloor(scene, 1, white, 0.003f);
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 64});
    ASSERT_TRUE(charts.has_value());
    const Texels texels = sampleTexels(rays, *charts, 4);
    size_t of_rug = 0;
    for (size_t i = 0; i < texels.size(); ++i) {
        const bool is_rug = samplePoint(rays, *charts, texels, i, 0).position_m.y > 0.003f;
        if (is_rug) {
            ++of_rug;
            EXPECT_EQ(texels.sampleCount(i), 4u);
        }
        for (uint32_t s = 0; s < texels.sampleCount(i); ++s)
            EXPECT_EQ(samplePoint(rays, *charts, texels, i, s).position_m.y > 0.003f, is_rug);
    }
    EXPECT_EQ(of_rug, 64u);  // 2 m x 2 m
}

// What the 64 texels of a floor reflect, all of them the same: in each lies a whole texture of 64 columns, along +Z.
float reflectanceOfTexels(AlphaMode mode, auto&& column) {
    Texture texture{64, 1, TransferFunction::Linear, {}};
    for (uint32_t x = 0; x < 64; ++x) texture.texels.push_back(column(x));
    Scene scene;
    scene.textures.push_back(std::make_shared<const Texture>(std::move(texture)));
    Material leaves = lambert(1);
    leaves.alpha_mode = mode;
    leaves.base_color_texture = 0;
    addFloor(scene, 1, addMaterial(scene, leaves)).uv0 = {{0, 0}, {8, 0}, {8, 0}, {0, 0}};
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 64});
    if (!charts) return -1;
    const Texels texels = sampleTexels(rays, *charts, 4);
    EXPECT_EQ(texels.size(), 64u);
    const float found = texels.reflectance[0].y;
    for (const glm::vec3 r : texels.reflectance) EXPECT_NEAR(r.y, found, 1e-5f);
    return found;
}

// Light that a texel gets from other surfaces is told by rays that hit it: they pass where it is cut out, whatever
// colour the texture has there. 51 of 255 is 0.2. Of a texel's 4 points 2 lie in each half, a twentieth off its edges.
TEST(Texels, ReflectByWhatIsNotCutOut) {
    constexpr glm::u8vec4 leaf(51, 51, 51, 255), hole(255, 255, 255, 0), glass(204, 204, 204, 51);
    const auto half = [](glm::u8vec4 right) { return [=](uint32_t x) { return x < 32 ? leaf : right; }; };
    EXPECT_NEAR(reflectanceOfTexels(AlphaMode::Mask, half(hole)), 0.2f, 1e-5f);
    EXPECT_NEAR(reflectanceOfTexels(AlphaMode::Blend, half(hole)), 0.2f, 1e-5f);
    // Of 0.8 and stopping a fifth: (0.2 + 0.2 * 0.8) / 1.2.
    EXPECT_NEAR(reflectanceOfTexels(AlphaMode::Blend, half(glass)), 0.3f, 1e-5f);
    // Alpha means nothing there: a mean of 0.2 and 0.8.
    EXPECT_NEAR(reflectanceOfTexels(AlphaMode::Opaque, half(glass)), 0.5f, 1e-5f);
}

// The points lie at ninths along the texture: none within a 32nd of its middle, where of 64 that are tried one does.
TEST(Texels, ReflectByWhatTheirPointsMiss) {
    constexpr glm::u8vec4 twig(51, 51, 51, 255), hole(255, 255, 255, 0);
    const auto middle = [](uint32_t x) { return x == 31 || x == 32 ? twig : hole; };
    EXPECT_NEAR(reflectanceOfTexels(AlphaMode::Mask, middle), 0.2f, 1e-5f);
    EXPECT_EQ(reflectanceOfTexels(AlphaMode::Mask, [](uint32_t) { return hole; }), 0);
}

// A sliding door that moves by its width: the open leaf goes on where the closed one ends, and is another surface.
TEST(Charts, OfAnOpenLeafAreNotTheClosedOnes) {
    Scene scene;
    scene.doors.push_back({"front", true});
    SceneMesh& leaf = addQuad(scene, "leaf", {0, 1, 0}, {0.5f, 0, 0}, {0, 1, 0}, addMaterial(scene, lambert(0.5f)));
    leaf.door = 0;
    leaf.open_from_closed[3] = {1, 0, 0, 1};
    addOpenLeaves(scene);
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 64});
    ASSERT_TRUE(charts.has_value());
    ASSERT_EQ(charts->faces.size(), 4u);
    const auto chartOf = [&](uint32_t triangle) { return charts->face_chart[charts->front_face[triangle]]; };
    EXPECT_EQ(chartOf(0), chartOf(1));
    EXPECT_EQ(chartOf(2), chartOf(3));
    EXPECT_NE(chartOf(0), chartOf(2));
}

// 400 m at 4 texels per metre are 1600 texels; a page of 256 keeps 254 of them: 6.3 times as coarse.
TEST(Charts, SaysWhatIsTooLargeForAPage) {
    Scene scene;
    addFloor(scene, 200, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    const auto coarse = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(coarse.has_value());
    ASSERT_EQ(coarse->warnings.size(), 1u);
    EXPECT_EQ(coarse->warnings[0].mesh, 0u);
    for (const char* part : {"6.3 times as coarse", "page_size"})
        EXPECT_TRUE(coarse->warnings[0].text.contains(part)) << coarse->warnings[0].text;
    EXPECT_TRUE(unwrap(rays, {.texels_per_metre = 4, .page_size = 4096})->warnings.empty());
}

// Forty quads of many shapes, none in another's plane.
Scene manyQuads() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    for (int i = 0; i < 40; ++i) {
        const auto side = static_cast<float>(i);
        addQuad(scene, "quad", {0, 5 * side, 0}, {1.3f + 0.37f * static_cast<float>(i % 5), 0, 0},
                {0, 0, 0.7f + 0.21f * side}, white);
    }
    return scene;
}

// What a chart stores, no other one may overwrite; and its ring is all padding.
TEST(Charts, LieApartOnTheirPages) {
    const Scene scene = manyQuads();
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 128});
    ASSERT_TRUE(charts.has_value());
    ASSERT_EQ(charts->charts.size(), 40u);
    ASSERT_GT(charts->page_count, 1u);  // some 30000 texels
    const size_t width = charts->page_width, height = charts->page_height;
    std::vector<int> charts_at(charts->page_count * width * height);
    for (const Chart& c : charts->charts) {
        ASSERT_LT(c.page, charts->page_count);
        ASSERT_LE(c.x + c.width, width);
        ASSERT_LE(c.y + c.height, height);
        for (size_t y = c.y; y < c.y + c.height; ++y)
            for (size_t x = c.x; x < c.x + c.width; ++x) ++charts_at[(c.page * height + y) * width + x];
    }
    EXPECT_EQ(std::ranges::max(charts_at), 1);
    for (size_t f = 0; f < charts->faces.size(); ++f) {
        const Chart& c = charts->charts[charts->face_chart[f]];
        const glm::vec2 low(c.x + 1, c.y + 1), high(c.x + c.width - 1, c.y + c.height - 1);
        for (const glm::vec2 uv : charts->uv_texels[f]) {
            EXPECT_TRUE(glm::all(glm::greaterThan(uv, low - 1e-3f))) << f;
            EXPECT_TRUE(glm::all(glm::lessThan(uv, high + 1e-3f))) << f;
        }
    }
}

// What a remedy says of a lower density: charts as unwrap() then makes them, and the pages that it packs.
// Sixteen squares fill a page of 256 texels; one more took a second of as much, for all of it: now 9 and 8 lie on two
// of 192.
TEST(Charts, NeedingTwoPagesTakeSmallOnes) {
    for (const int count : {16, 17}) {
        Scene scene;
        const uint32_t grey = addMaterial(scene, lambert(0.5f));
        for (int i = 0; i < count; ++i)
            addQuad(scene, "square", {20.0f * static_cast<float>(i), 0, 0}, {0, 0, 7.5f}, {7.5f, 0, 0}, grey);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        EXPECT_EQ(charts->page_count, count == 16 ? 1u : 2u);
        EXPECT_EQ(charts->page_width, count == 16 ? 256u : 192u);
        EXPECT_LE(charts->page_height, charts->page_width);
    }
}

TEST(Charts, OfLongerTexelsAreForetold) {
    const Scene scene = manyQuads();
    const RayScene rays(scene);
    const auto fine = unwrap(rays, {.texels_per_metre = 8, .page_size = 2048});
    ASSERT_TRUE(fine.has_value());
    const auto texelsOf = [](const Unwrap& u) {
        return static_cast<double>(u.page_width) * u.page_height * u.page_count;
    };
    std::vector<glm::uvec2> sizes;
    for (const Chart& c : fine->charts) sizes.emplace_back(c.width, c.height);
    EXPECT_EQ(static_cast<double>(pageTexels(sizes, 2048)), texelsOf(*fine));
    for (const float density : {6.0f, 4.0f, 2.0f}) {
        const auto coarse = unwrap(rays, {.texels_per_metre = density, .page_size = 2048});
        ASSERT_TRUE(coarse.has_value());
        std::vector<glm::uvec2> foretold;
        for (const glm::uvec2 c : sizes) foretold.push_back(chartSize(c, double{8 / density}));
        // Each side is at most one texel too long: of some 10 to 60 texels a quarter at the most; pages come in steps.
        const double ratio = static_cast<double>(pageTexels(foretold, 2048)) / texelsOf(*coarse);
        EXPECT_GE(ratio, 0.9) << density;
        EXPECT_LE(ratio, 1.3) << density;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
