#include <gtest/gtest.h>
#include <probes/lit_cells.h>
#include <probes/tetrahedron_walk.h>

#include "../runtime/model_pack.h"

namespace dimmer {
namespace {

constexpr glm::vec3 room_m = test::model_room_m;

PackData darkPack(uint32_t seed, uint32_t probes) {
    return test::modelPack(seed, probes, [](glm::vec3) { return glm::vec3(0); });
}

std::array<float, 3> arrayOf(glm::vec3 p) {
    return {p.x, p.y, p.z};
}

bool changedAt(const LitCells& cells, glm::vec3 p) {
    return cells.changedIn({arrayOf(p), arrayOf(p)});
}

// What the walk says: whether a probe of the cluster is a corner of the tetrahedron that the place is in.
bool isLitBy(const PackData& data, const Cluster& cluster, glm::vec3 p) {
    const GlobalGrid& grid = data.probes.global;
    const auto numbers = std::span(data.probes.numbers).subspan(cluster.first_receiver, cluster.receiver_count);
    return std::ranges::any_of(grid.tetrahedra[locate(grid, arrayOf(p)).tetrahedron].probes,
                               [&](uint32_t probe) { return std::ranges::find(numbers, probe) != numbers.end(); });
}

// Anywhere in the room, on its border, and exactly on probes, where many tetrahedra meet.
glm::vec3 somePlace(const GlobalGrid& grid, test::Random& random) {
    glm::vec3 p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = test::uniform(random, 0, room_m[axis]);
    const uint32_t kind = test::pick(random, 0, 3);
    if (kind < 3) return p;
    const int side = static_cast<int>(test::pick(random, 0, 6));
    if (side < 3) p[side] = test::pick(random, 0, 1) ? room_m[side] : 0;
    if (side < 3) return p;
    const auto& at = grid.positions[test::pick(random, 0, static_cast<uint32_t>(grid.positions.size()) - 1)];
    return {at.x_m, at.y_m, at.z_m};
}

TEST(LitCells, NoPlaceThatAChangedClusterLightsIsMissed) {
    for (const uint32_t probes : {2u, 30u, 2000u}) {
        PackData data = darkPack(probes, probes);
        test::Random random(5);
        for (uint32_t set = 0; set < 3; ++set)
            test::addLightOnProbes(data, set, 0, [&](glm::vec3) { return test::pick(random, 0, 9) == set; });
        LitCells cells(data);
        size_t lit = 0;
        for (uint32_t cluster = 0; cluster < 3; ++cluster) {
            cells.clear();
            cells.change(cluster);
            for (int i = 0; i < 3000; ++i) {
                const glm::vec3 p = somePlace(data.probes.global, random);
                if (!isLitBy(data, data.probes.clusters[cluster], p)) continue;
                ++lit;
                EXPECT_TRUE(changedAt(cells, p)) << p.x << " " << p.y << " " << p.z;
            }
        }
        EXPECT_GT(lit, 100u);
    }
}

// Nothing but its indices is asked of a file's tetrahedra: a million across the level took minutes and gigabytes. What
// is not looked at counts as everywhere, also for places that none of them reaches.
TEST(LitCells, TetrahedraAcrossTheLevelTakeNoMoreThanOthers) {
    PackData data = darkPack(1, 30);
    test::addLightOnProbes(data, 0, 0, [](glm::vec3) { return true; });
    GlobalGrid& grid = data.probes.global;
    const glm::vec3 low = 0.01f * room_m, high = 0.99f * room_m, far_off = room_m * glm::vec3(0.95f, 0.05f, 0.95f);
    const std::array corners = {low, glm::vec3(low.x, low.y, high.z), glm::vec3(low.x, high.y, low.z), high};
    for (uint32_t i = 0; i < 4; ++i) grid.positions[i] = {corners[i].x, corners[i].y, corners[i].z};
    const Tetrahedron across{.probes = {0, 1, 2, 3}};
    for (const uint32_t count : {10u, 20000u}) {
        grid.tetrahedra.assign(count, across);
        LitCells cells(data);
        cells.change(0);
        EXPECT_TRUE(changedAt(cells, 0.5f * (low + high)));
        EXPECT_EQ(changedAt(cells, far_off), count > 10) << count;
        cells.clear();
        EXPECT_FALSE(changedAt(cells, 0.5f * (low + high)));
    }
}

// How far a place is outside a tetrahedron, at least: from its box or one of its faces.
float distanceAtLeast(const GlobalGrid& grid, const Tetrahedron& tetrahedron, glm::vec3 p) {
    std::array<glm::vec3, 4> corners;
    for (size_t i = 0; i < 4; ++i) {
        const ProbePosition& at = grid.positions[tetrahedron.probes[i]];
        corners[i] = {at.x_m, at.y_m, at.z_m};
    }
    const auto all = [&](auto&& of) { return of(of(corners[0], corners[1]), of(corners[2], corners[3])); };
    const glm::vec3 low = all([](glm::vec3 a, glm::vec3 b) { return glm::min(a, b); });
    const glm::vec3 high = all([](glm::vec3 a, glm::vec3 b) { return glm::max(a, b); });
    float distance_m = glm::distance(p, glm::clamp(p, low, high));
    for (size_t i = 0; i < 4; ++i) {
        const glm::vec3 a = corners[(i + 1) % 4], b = corners[(i + 2) % 4], c = corners[(i + 3) % 4];
        const glm::vec3 normal = glm::normalize(glm::cross(b - a, c - a));
        const float inward = glm::dot(corners[i] - a, normal) > 0 ? 1.0f : -1.0f;
        distance_m = std::max(distance_m, -inward * glm::dot(p - a, normal));
    }
    return distance_m;
}

// 16,384 cells or less share the room, cubes of 33 cm: what is further than a cell's diagonal from all that a cluster
// lights is in no cell of its. A cluster at both ends leaves the middle alone.
TEST(LitCells, NoPlaceFurtherThanACellIsTakenForLit) {
    PackData data = darkPack(1, 2000);
    test::addLightOnProbes(data, 0, 0, [](glm::vec3 p) { return p.x < 2 || p.x > 10; });
    const GlobalGrid& grid = data.probes.global;
    const auto& numbers = data.probes.numbers;
    std::vector<Tetrahedron> lit;
    std::ranges::copy_if(grid.tetrahedra, std::back_inserter(lit), [&](const Tetrahedron& t) {
        return std::ranges::any_of(t.probes,
                                   [&](uint32_t p) { return std::ranges::find(numbers, p) != numbers.end(); });
    });
    const float diagonal_m = std::sqrt(3.0f) * std::cbrt(room_m.x * room_m.y * room_m.z / 16384);
    constexpr float walks_m = 0.01f;  // a thousandth of the largest tetrahedron: more than walks take in from outside
    const LitCells idle(data);
    LitCells cells(data);
    cells.change(0);
    test::Random random(6);
    int far = 0;
    for (int i = 0; i < 4000; ++i) {
        const glm::vec3 p = somePlace(grid, random);
        EXPECT_FALSE(changedAt(idle, p));
        if (std::ranges::any_of(lit, [&](const auto& t) { return distanceAtLeast(grid, t, p) < diagonal_m + walks_m; }))
            continue;
        ++far;
        EXPECT_FALSE(changedAt(cells, p)) << p.x << " " << p.y << " " << p.z;
    }
    EXPECT_GT(far, 500);
    cells.clear();
    EXPECT_FALSE(cells.changedIn({arrayOf(glm::vec3(-1)), arrayOf(room_m + 1.0f)}));
}

TEST(LitCells, ABoxIsConcernedByAnyPlaceInIt) {
    PackData data = darkPack(1, 2000);
    test::addLightOnProbes(data, 0, 0, [](glm::vec3 p) { return glm::distance(p, room_m / 2.0f) < 1; });
    LitCells cells(data);
    cells.change(0);
    EXPECT_TRUE(cells.changedIn({arrayOf(glm::vec3(0)), arrayOf(room_m)}));
    EXPECT_TRUE(cells.changedIn({{-1e30f, 1.9f, 5.9f}, {1e30f, 2.1f, 6.1f}}));
    EXPECT_FALSE(cells.changedIn({{0, 0, 0}, {3, 4, 12}}));
    EXPECT_FALSE(cells.changedIn({{-9, -9, -9}, {-8, -8, -8}}));  // lit as the corner is
}

}  // namespace
}  // namespace dimmer
