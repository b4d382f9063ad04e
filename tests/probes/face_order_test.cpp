// Grids numbered face by face: the same grids, and cheap to tell.
#include <gtest/gtest.h>
#include <pack/stored_tables.h>
#include <probes/face_order.h>
#include <probes/tetrahedra.h>
#include <probes/tetrahedron_walk.h>
#include <runtime/random_pack.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace dimmer::cook {
namespace {

using dimmer::test::pick;
using dimmer::test::Random;
using dimmer::test::uniform;

GlobalGrid randomGrid(size_t probes) {
    Random random(7);
    std::vector<glm::vec3> points(probes);
    for (auto& p : points) p = {uniform(random, 0, 8), uniform(random, 0, 3), uniform(random, 0, 5)};
    points[5] = points[3];  // joins no tetrahedron
    GlobalGrid grid = tetrahedralise(points, {glm::vec3(0), glm::vec3(8, 3, 5)}).value();
    for (uint8_t& level : grid.levels) level = static_cast<uint8_t>(pick(random, 0, 9));
    for (size_t i = 0; i < grid.tetrahedra.size(); ++i) {
        auto& v = grid.visibility.emplace_back();
        for (auto& probe : v.seen)
            for (int8_t& value : probe) value = static_cast<int8_t>(pick(random, 0, 255));
    }
    return grid;
}

// Probes by their old numbers, and what each sees at each of them.
using Seen = std::map<std::pair<uint32_t, uint32_t>, int8_t>;

std::map<std::set<uint32_t>, Seen> contentOf(const GlobalGrid& grid, const std::vector<uint32_t>& old) {
    std::map<std::set<uint32_t>, Seen> content;
    for (size_t i = 0; i < grid.tetrahedra.size(); ++i) {
        const auto& probes = grid.tetrahedra[i].probes;
        std::set<uint32_t> names;
        Seen seen;
        for (size_t v = 0; v < 4; ++v) {
            names.insert(old[probes[v]]);
            for (size_t k = 0; k < 4; ++k) seen[{old[probes[v]], old[probes[k]]}] = grid.visibility[i].seen[v][k];
        }
        content[names] = seen;
    }
    return content;
}

TEST(FaceOrder, IsTheSameGrid) {
    const GlobalGrid before = randomGrid(300);
    GlobalGrid after = before;
    const std::vector<uint32_t> old = orderByFaces(after);
    std::vector<uint32_t> as_it_was(before.positions.size());
    for (uint32_t i = 0; i < as_it_was.size(); ++i) as_it_was[i] = i;
    EXPECT_EQ(std::set(old.begin(), old.end()), std::set(as_it_was.begin(), as_it_was.end()));
    for (size_t i = 0; i < old.size(); ++i) {
        EXPECT_EQ(after.positions[i], before.positions[old[i]]);
        EXPECT_EQ(after.levels[i], before.levels[old[i]]);
    }
    for (size_t i = old.size() - grid_box_corners; i < old.size(); ++i) EXPECT_EQ(old[i], i);
    EXPECT_EQ(contentOf(after, old), contentOf(before, as_it_was));
    EXPECT_EQ(after.tetrahedra.size(), before.tetrahedra.size());
    EXPECT_EQ(after.start.counts, before.start.counts);
    // Walks that begin at starts, and at any hint, end in the same place.
    Random random(1);
    for (int i = 0; i < 2000; ++i) {
        const std::array<float, 3> p = {uniform(random, -1, 9), uniform(random, -1, 4), uniform(random, -1, 6)};
        const auto hint = pick(random, 0, static_cast<uint32_t>(after.tetrahedra.size()) - 1);
        const GridPlace a = locate(before, p), b = locate(after, p, i % 2 == 0 ? no_tetrahedron : hint);
        for (size_t k = 0; k < 4; ++k) {
            const uint32_t probe = old[after.tetrahedra[b.tetrahedron].probes[k]];
            float share = 0;
            for (size_t j = 0; j < 4; ++j)
                if (before.tetrahedra[a.tetrahedron].probes[j] == probe) share = a.barycentric[j];
            EXPECT_NEAR(b.barycentric[k], share, 2e-4f) << "the walk's tolerance, and floats in thin tetrahedra";
        }
    }
}

TEST(FaceOrder, AllButTheFirstTetrahedronAreToldByOneProbe) {
    GlobalGrid grid = randomGrid(300);
    const size_t count = grid.tetrahedra.size();
    EXPECT_GT(storedTetrahedra(grid.tetrahedra, grid.positions.size()).size(), 3 * count) << "TetGen's order";
    orderByFaces(grid);
    const auto stored = storedTetrahedra(grid.tetrahedra, grid.positions.size());
    EXPECT_EQ(stored.size(), count + 3);
    // Every probe but those of the box and the one of no tetrahedron comes up once as the next number.
    EXPECT_EQ(std::ranges::count(stored, 0u, &StoredTetrahedron::probe), 300 - 1);
    const auto restored = restoredTetrahedra(stored, grid.positions.size());
    ASSERT_TRUE(restored);
    EXPECT_EQ(*restored, grid.tetrahedra);
}

TEST(FaceOrder, OfTheBoxAloneAndOfNothing) {
    GlobalGrid box = tetrahedralise({}, {glm::vec3(0), glm::vec3(1)}).value();
    EXPECT_EQ(orderByFaces(box), (std::vector<uint32_t>{0, 1, 2, 3, 4, 5, 6, 7}));
    const auto restored = restoredTetrahedra(storedTetrahedra(box.tetrahedra, 8), 8);
    ASSERT_TRUE(restored);
    EXPECT_EQ(*restored, box.tetrahedra);
    GlobalGrid none;
    EXPECT_TRUE(orderByFaces(none).empty());
    EXPECT_TRUE(none.empty());
    EXPECT_TRUE(restoredTetrahedra({}, 0)->empty());
}

TEST(FaceOrder, RecordsOfNoTetrahedraAreRefused) {
    const std::vector<StoredTetrahedron> one(4, {0, 0});  // 0 1 2 3
    ASSERT_TRUE(restoredTetrahedra(one, 12));
    using Records = std::vector<StoredTetrahedron>;
    const auto with = [&](Records more) {
        Records all = one;
        all.insert(all.end(), more.begin(), more.end());
        return restoredTetrahedra(all, 12);
    };
    EXPECT_TRUE(with({{4, 0}}));
    EXPECT_FALSE(with({{3, 0}})) << "from itself";
    EXPECT_FALSE(with({{8, 0}})) << "from before the first";
    EXPECT_FALSE(with({{UINT32_MAX, 0}}));
    EXPECT_FALSE(with({{4, 5}})) << "probe -1";
    EXPECT_FALSE(with({{4, UINT32_MAX - 7}})) << "probe 12 of 12";
    EXPECT_TRUE(with({{4, UINT32_MAX - 6}})) << "probe 11 of 12";
    EXPECT_FALSE(with({{0, 0}})) << "a corner alone";
    EXPECT_FALSE(with({{0, 0}, {0, 0}, {0, 0}, {4, 0}})) << "three corners";
    EXPECT_FALSE(with({{4, 0}, {8, 1}})) << "the face of 1, 2 and 3 three times";
}

}  // namespace
}  // namespace dimmer::cook
