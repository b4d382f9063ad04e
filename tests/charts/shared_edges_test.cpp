// Meshes stay closed where walls cut what lies beside others.
#include <charts/shared_edges.h>
#include <charts/two_rooms.h>
#include <charts/wall_cuts.h>
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <vector>

namespace dimmer::cook::test {
namespace {

using Places = std::vector<glm::vec3>;

bool lessThan(glm::vec3 a, glm::vec3 b) {
    return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z};
}

Places placesOf(const Scene& scene) {
    Places places;
    for (const SceneMesh& mesh : scene.meshes)
        for (const glm::uvec3 t : mesh.triangles)
            for (int i = 0; i < 3; ++i) places.push_back(mesh.positions_m[t[i]]);
    std::ranges::sort(places, lessThan);
    places.erase(std::ranges::unique(places).begin(), places.end());
    return places;
}

// Of `places`, those that lie between the ends of an edge along which no triangle of the mesh goes back.
// `near_m`: what a gap that shows is wider than; rounding at 6 m is 5e-7.
size_t placesWithinEdges(const Scene& scene, const Places& places, double near_m = 1e-4) {
    size_t within = 0;
    for (const SceneMesh& mesh : scene.meshes) {
        std::set<std::array<float, 6>> edges;
        for (const glm::uvec3 triangle : mesh.triangles)
            for (int i = 0; i < 3; ++i) {
                const glm::vec3 a = mesh.positions_m[triangle[i]], b = mesh.positions_m[triangle[(i + 1) % 3]];
                edges.insert({a.x, a.y, a.z, b.x, b.y, b.z});
            }
        for (const auto& e : edges) {
            if (edges.contains({e[3], e[4], e[5], e[0], e[1], e[2]})) continue;
            const glm::dvec3 a(e[0], e[1], e[2]), b(e[3], e[4], e[5]);
            within += static_cast<size_t>(std::ranges::count_if(places, [&](const glm::dvec3 p) {
                const double t = glm::dot(p - a, b - a) / glm::dot(b - a, b - a);
                return p != a && p != b && t > 0 && t < 1 && glm::distance(p, a + t * (b - a)) < near_m;
            }));
        }
    }
    return within;
}

double areaOf(const SceneMesh& mesh) {
    double area = 0;
    for (const glm::uvec3 t : mesh.triangles) {
        const glm::dvec3 a = mesh.positions_m[t.x], b = mesh.positions_m[t.y], c = mesh.positions_m[t.z];
        area += glm::length(glm::cross(b - a, c - a)) / 2;
    }
    return area;
}

// Coordinates that are the place itself: cuts must not move it.
void paint(Scene& scene) {
    for (SceneMesh& mesh : scene.meshes)
        for (const glm::vec3 p : mesh.positions_m) mesh.uv0.emplace_back(p.x + 0.25f * p.y, p.z - 0.5f * p.y);
}

// Three rooms in an angle: cuts cross others, and end on edges of walls, of sides of the floor and of themselves.
Scene rooms() {
    Scene scene = twoRooms();
    addSolid(scene, "wall", {2.05f, 1.35f, 0.1f}, {1.95f, 1.35f, half_wall_m}, 0);
    return scene;
}

TEST(SharedEdges, CutsLeaveNoVertexWithinAnEdge) {
    for (const float degrees : {0.0f, 30.0f}) {
        SCOPED_TRACE(degrees);
        Scene scene = rooms();
        const glm::mat3 turned(glm::rotate(glm::mat4(1), glm::radians(degrees), {0, 1, 0}));
        for (SceneMesh& mesh : scene.meshes) {
            for (glm::vec3& p : mesh.positions_m) p = turned * p;
            for (glm::vec3& n : mesh.normals) n = turned * n;
        }
        paint(scene);
        const Scene before = scene;
        cutAtWalls(scene, 4);
        const Places old = placesOf(before);
        Places fresh;
        std::ranges::set_difference(placesOf(scene), old, std::back_inserter(fresh), lessThan);
        EXPECT_GT(fresh.size(), 12u);  // two walls' ends on floor and ceiling, on top and below
        EXPECT_EQ(placesWithinEdges(scene, fresh), 0u);
        for (size_t m = 0; m < scene.meshes.size(); ++m) {
            const SceneMesh& mesh = scene.meshes[m];
            // Of 24 m2: places are rounded to 5e-7 m, and parts share their edges.
            EXPECT_NEAR(areaOf(mesh), areaOf(before.meshes[m]), 1e-4) << mesh.node;
            ASSERT_EQ(mesh.uv0.size(), mesh.positions_m.size());
            for (size_t v = 0; v < mesh.positions_m.size(); ++v) {
                const glm::vec3 p = mesh.positions_m[v];
                EXPECT_LT(glm::distance(mesh.uv0[v], {p.x + 0.25f * p.y, p.z - 0.5f * p.y}), 2e-4f);
                EXPECT_NEAR(glm::length(mesh.normals[v]), 1, 1e-5f);
            }
        }
    }
}

// Far out floats are coarser than what cuts differ by near the origin.
TEST(SharedEdges, CutsFarFromTheOriginAreClosedToo) {
    Scene scene = rooms();
    const glm::mat3 turned(glm::rotate(glm::mat4(1), glm::radians(30.0f), {0, 1, 0}));
    for (SceneMesh& mesh : scene.meshes) {
        for (glm::vec3& p : mesh.positions_m) p = turned * p + glm::vec3(3900, 0, -3700);
        for (glm::vec3& n : mesh.normals) n = turned * n;
    }
    const Places old = placesOf(scene);
    cutAtWalls(scene, 4);
    Places fresh;
    std::ranges::set_difference(placesOf(scene), old, std::back_inserter(fresh), lessThan);
    EXPECT_GT(fresh.size(), 12u);
    EXPECT_EQ(placesWithinEdges(scene, fresh, 4 * 2.44e-4), 0u);  // four steps of floats from 2048 m on
}

// Where a cut meets normals that look opposite ways, and triangles too small to have an area in floats.
TEST(SharedEdges, OddTrianglesStay) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    SceneMesh mesh;
    mesh.positions_m = {{0, 0, 0}, {0, 0, 2}, {2, 0, 0}, {5, 0, 0}, {5, 0, 1e-5f}, {5 + 1e-5f, 0, 0}, {0, 0, 1}};
    mesh.normals = {{0, 1, 0}, {0, -1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    mesh.triangle_materials = {grey, grey};
    scene.meshes = {mesh};
    splitSharedEdges(scene, std::array<CutMesh, 1>{{{0, 6}}});
    ASSERT_EQ(scene.meshes[0].triangles.size(), 3u);
    EXPECT_EQ(scene.meshes[0].triangles.back(), glm::uvec3(3, 4, 5));
    for (const glm::vec3 n : scene.meshes[0].normals) EXPECT_NEAR(glm::length(n), 1, 1e-5f);
}

// All of a triangle's edges end at cuts of its neighbours, at its corners too; its material goes to all parts.
TEST(SharedEdges, ATriangleIsSplitOnEveryEdge) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f)), white = addMaterial(scene, lambert(0.8f));
    SceneMesh whole;
    whole.positions_m = {{0, 0, 0}, {0, 0, 2}, {2, 0, 0}};
    whole.normals.assign(3, {0, 1, 0});
    whole.triangles = {{0, 1, 2}};
    whole.triangle_materials = {white};
    whole.triangle_regions = {7};
    SceneMesh cut;  // its own triangle is elsewhere; its new vertices lie on the other's edges
    cut.positions_m = {{0, 5, 0}, {0, 5, 2}, {2, 5, 0}};
    cut.normals.assign(9, {0, 1, 0});
    cut.triangles = {{0, 1, 2}};
    cut.triangle_materials = {grey};
    const Places fresh = {{0, 0, 0.5f}, {0, 0, 1.5f}, {1, 0, 1}, {0.5f, 0, 0}, {1, 0, 0}, {0.000001f, 0, 1.999999f}};
    cut.positions_m.insert(cut.positions_m.end(), fresh.begin(), fresh.end());
    scene.meshes = {whole, cut};
    splitSharedEdges(scene, std::array<CutMesh, 2>{{{0, 3}, {1, 3}}});
    const SceneMesh& split = scene.meshes[0];
    // Three corners and five points on edges, none within: six triangles.
    ASSERT_EQ(split.triangles.size(), 6u);
    EXPECT_EQ(split.triangle_materials, std::vector<uint32_t>(6, white));
    EXPECT_EQ(split.triangle_regions, std::vector<uint32_t>(6, 7));
    EXPECT_EQ(placesWithinEdges(scene, Places(fresh.begin(), fresh.end() - 1)), 0u);
    EXPECT_NEAR(areaOf(split), 2, 1e-6);
    for (const glm::uvec3 t : split.triangles) {
        const glm::vec3 a = split.positions_m[t.x], b = split.positions_m[t.y], c = split.positions_m[t.z];
        EXPECT_GT(glm::cross(b - a, c - a).y, 0.1f);
    }
    EXPECT_EQ(scene.meshes[1].triangles.size(), 1u);
    EXPECT_EQ(scene.meshes[1].positions_m.back(), whole.positions_m[1]);  // in its place, bit for bit
}

}  // namespace
}  // namespace dimmer::cook::test
