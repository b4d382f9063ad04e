// Tetrahedra over any points, and the walk to the one that a place lies in.
#include <gtest/gtest.h>
#include <probes/tetrahedra.h>
#include <probes/tetrahedron_walk.h>
#include <runtime/random_pack.h>

#include <cmath>

namespace dimmer::cook {
namespace {

using dimmer::test::pick;
using dimmer::test::Random;
using dimmer::test::uniform;

glm::dvec3 at(const GlobalGrid& grid, uint32_t probe) {
    const ProbePosition& p = grid.positions[probe];
    return {p.x_m, p.y_m, p.z_m};
}

double signedVolume(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
    return glm::dot(b - a, glm::cross(c - a, d - a));
}

// Barycentric coordinates in 64-bit floats, corner by corner from the definition.
std::array<double, 4> barycentric(const GlobalGrid& grid, const Tetrahedron& t, const glm::dvec3& p) {
    std::array<glm::dvec3, 4> corners;
    for (size_t i = 0; i < 4; ++i) corners[i] = at(grid, t.probes[i]);
    const double whole = signedVolume(corners[0], corners[1], corners[2], corners[3]);
    std::array<double, 4> result;
    for (size_t i = 0; i < 4; ++i) {
        auto moved = corners;
        moved[i] = p;
        result[i] = signedVolume(moved[0], moved[1], moved[2], moved[3]) / whole;
    }
    return result;
}

GlobalGrid gridOf(std::span<const glm::vec3> points) {
    auto grid = tetrahedralise(points, {glm::vec3(0), glm::vec3(1)});
    if (!grid) throw std::runtime_error(grid.error().message);
    return std::move(*grid);
}

// Faces are shared by exactly the two tetrahedra that name each other, and the volumes fill the box: together that is a
// tetrahedralisation.
void expectTetrahedralisation(const GlobalGrid& grid) {
    double volume = 0;
    for (uint32_t i = 0; i < grid.tetrahedra.size(); ++i) {
        const Tetrahedron& t = grid.tetrahedra[i];
        const double v =
            signedVolume(at(grid, t.probes[0]), at(grid, t.probes[1]), at(grid, t.probes[2]), at(grid, t.probes[3]));
        ASSERT_GE(v, 0) << "tetrahedron " << i << " is inside out";
        volume += v / 6;
        for (size_t face = 0; face < 4; ++face) {
            if (t.neighbours[face] == no_tetrahedron) continue;
            const Tetrahedron& n = grid.tetrahedra.at(t.neighbours[face]);
            size_t back = 4, shared = 0;
            for (size_t k = 0; k < 4; ++k) {
                if (n.neighbours[k] == i) back = k;
                for (size_t j = 0; j < 4; ++j) shared += j != face && n.probes[k] == t.probes[j];
            }
            ASSERT_LT(back, 4u) << "neighbour " << t.neighbours[face] << " does not know tetrahedron " << i;
            ASSERT_EQ(shared, 3u) << "neighbours share a face";
        }
    }
    double box = 1;
    for (size_t axis = 0; axis < 3; ++axis) box *= double{grid.start.max_m[axis]} - double{grid.start.min_m[axis]};
    EXPECT_NEAR(volume, box, 1e-9 * box);  // sums of some thousand doubles
}

// The place found is inside its tetrahedron as far as 32-bit floats can tell: no tetrahedron holds the point better by
// more than the walk's tolerance and the rounding of barycentric coordinates in thin ones.
void expectRightPlace(const GlobalGrid& grid, const glm::vec3& p, uint32_t hint) {
    const GridPlace place = locate(grid, {p.x, p.y, p.z}, hint);
    ASSERT_LT(place.tetrahedron, grid.tetrahedra.size());
    float sum = 0;
    glm::dvec3 back(0);
    for (size_t i = 0; i < 4; ++i) {
        ASSERT_TRUE(std::isfinite(place.barycentric[i]));
        ASSERT_GE(place.barycentric[i], 0);
        sum += place.barycentric[i];
        back += double{place.barycentric[i]} * at(grid, grid.tetrahedra[place.tetrahedron].probes[i]);
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    // The weights bring back the point itself, clamped to the box: within the walk's tolerance of the largest edge.
    glm::dvec3 size, clamped;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = grid.start.min_m[static_cast<size_t>(axis)],
                     high = grid.start.max_m[static_cast<size_t>(axis)];
        size[axis] = high - low;
        clamped[axis] = std::clamp(double{p[axis]}, low, high);
    }
    EXPECT_LT(glm::distance(back, clamped), 1e-3 * glm::length(size));
}

TEST(Tetrahedra, OfNoPointAreTheBox) {
    const GlobalGrid grid = gridOf({});
    EXPECT_EQ(grid.positions.size(), 8u);
    expectTetrahedralisation(grid);
    expectRightPlace(grid, {0.5f, 0.5f, 0.5f}, no_tetrahedron);
}

TEST(Tetrahedra, OfPointsOnALineInAPlaneOrTwice) {
    std::vector<glm::vec3> line, plane, twice;
    for (int i = 0; i < 20; ++i) line.emplace_back(i, 2 * i, -i);
    for (int i = 0; i < 100; ++i) plane.emplace_back(i % 10, 3, i / 10);
    for (int i = 0; i < 60; ++i) twice.emplace_back(i % 30 * 0.1f, i % 7, i % 5);
    for (const auto& points : {line, plane, twice, std::vector(12, glm::vec3(1, 2, 3))}) {
        const GlobalGrid grid = gridOf(points);
        EXPECT_EQ(grid.positions.size(), points.size() + 8);
        expectTetrahedralisation(grid);
        for (const glm::vec3& p : points) expectRightPlace(grid, p, no_tetrahedron);
    }
}

TEST(Tetrahedra, RefusePlacesThatAreNone) {
    for (const float bad : {std::nanf(""), INFINITY, 2e6f}) {
        const std::vector<glm::vec3> points = {{0, 0, 0}, {0, bad, 0}};
        const auto grid = tetrahedralise(points, {glm::vec3(0), glm::vec3(1)});
        ASSERT_FALSE(grid);
        EXPECT_EQ(grid.error().code, ErrorCode::InvalidArgument);
    }
}

TEST(Tetrahedra, AreTheSameEveryTime) {
    Random random(5);
    std::vector<glm::vec3> points(500);
    for (auto& p : points) p = {uniform(random, 0, 9), uniform(random, 0, 3), uniform(random, 0, 9)};
    const GlobalGrid a = gridOf(points), b = gridOf(points);
    EXPECT_EQ(a.tetrahedra, b.tetrahedra);
    EXPECT_EQ(a.starts, b.starts);
}

// No point lies inside the sphere through a tetrahedron's corners.
TEST(Tetrahedra, AreDelaunay) {
    Random random(6);
    std::vector<glm::vec3> points(200);
    for (auto& p : points) p = {uniform(random, 0, 9), uniform(random, 0, 3), uniform(random, 0, 9)};
    const GlobalGrid grid = gridOf(points);
    for (const Tetrahedron& t : grid.tetrahedra) {
        // Centre: equally far from all corners, a linear system in it.
        const glm::dvec3 o = at(grid, t.probes[0]);
        glm::dmat3 rows;
        glm::dvec3 right;
        for (int i = 0; i < 3; ++i) {
            const glm::dvec3 edge = at(grid, t.probes[static_cast<size_t>(i) + 1]) - o;
            rows[i] = edge;
            right[i] = 0.5 * glm::dot(edge, edge);
        }
        const glm::dvec3 centre = glm::inverse(glm::transpose(rows)) * right;
        const double radius = glm::length(centre);
        for (uint32_t p = 0; p < grid.positions.size(); ++p)
            ASSERT_GT(glm::distance(at(grid, p), o + centre), radius * (1 - 1e-6));  // corners themselves: equal
    }
}

// A thing's light must not depend on the way that it came. Places on faces and next to them, where two tetrahedra take
// a point in.
TEST(TetrahedronWalk, EndsInOnePlaceWhateverTheHint) {
    Random random(8);
    std::vector<glm::vec3> points(300);
    for (auto& p : points) p = {uniform(random, -4, 4), uniform(random, 0, 3), uniform(random, -4, 4)};
    const GlobalGrid grid = gridOf(points);
    const auto last = static_cast<uint32_t>(grid.tetrahedra.size()) - 1;
    for (int i = 0; i < 20000; ++i) {
        const Tetrahedron& t = grid.tetrahedra[pick(random, 0, last)];
        std::array<double, 4> shares{};  // well inside a face, and a little off it
        double sum = 0;
        for (size_t k = 1; k < 4; ++k) sum += shares[k] = static_cast<double>(uniform(random, 0.1f, 1));
        for (size_t k = 1; k < 4; ++k) shares[k] /= sum;
        const double off = i % 2 ? 0 : static_cast<double>(std::exp2(uniform(random, -26, -12)));
        shares[0] = i % 4 ? off : -off;
        glm::dvec3 p(0);
        for (size_t k = 0; k < 4; ++k) p += shares[k] * at(grid, t.probes[k]);
        const std::array<float, 3> point = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
        const GridPlace place = locate(grid, point);
        for (const uint32_t hint : {t.neighbours[0], pick(random, 0, last), pick(random, 0, last)}) {
            const GridPlace again = locate(grid, point, hint);
            ASSERT_EQ(again.tetrahedron, place.tetrahedron) << i;
            ASSERT_EQ(again.barycentric, place.barycentric) << i;
        }
    }
}

TEST(TetrahedronWalk, FindsWhatBruteForceFinds) {
    Random random(7);
    std::vector<glm::vec3> points(300);
    for (auto& p : points) p = {uniform(random, -4, 4), uniform(random, 0, 3), uniform(random, -4, 4)};
    const GlobalGrid grid = gridOf(points);
    for (int i = 0; i < 2000; ++i) {
        const glm::vec3 p = {uniform(random, -5, 5), uniform(random, -1, 4), uniform(random, -5, 5)};
        const glm::dvec3 clamped =
            glm::clamp(glm::dvec3(p), glm::dvec3(grid.start.min_m[0], grid.start.min_m[1], grid.start.min_m[2]),
                       glm::dvec3(grid.start.max_m[0], grid.start.max_m[1], grid.start.max_m[2]));
        double best = -1e30;
        size_t right = 0;
        for (size_t t = 0; t < grid.tetrahedra.size(); ++t) {
            const double inside = std::ranges::min(barycentric(grid, grid.tetrahedra[t], clamped));
            if (inside > best) best = inside, right = t;
        }
        const uint32_t hint =
            i % 3 == 0 ? no_tetrahedron : pick(random, 0, static_cast<uint32_t>(grid.tetrahedra.size()) - 1);
        const GridPlace place = locate(grid, {p.x, p.y, p.z}, hint);
        const double inside = std::ranges::min(barycentric(grid, grid.tetrahedra[place.tetrahedron], clamped));
        // Another tetrahedron only where the point lies on the border of both, within the walk's tolerance.
        EXPECT_TRUE(place.tetrahedron == right || inside > -2e-4) << "brute force: " << right << " with " << best;
    }
}

// A tunnel of a kilometre along each axis: from one end to the other it is more tetrahedra than a walk may take, so
// each must begin near by.
TEST(TetrahedronWalk, ArrivesEverywhereInALevelOfAKilometre) {
    for (int axis = 0; axis < 3; ++axis) {
        Random random(9);
        const auto across = [&](float along, float side, float up) {
            glm::vec3 p;
            p[axis] = along;
            p[(axis + 1) % 3] = side;
            p[(axis + 2) % 3] = up;
            return p;
        };
        std::vector<glm::vec3> points;
        for (int i = 0; i < 6000; ++i) {
            const auto cell = static_cast<float>(i / 6);
            points.push_back(across(cell + uniform(random, 0, 0.5f),
                                    static_cast<float>(i % 3) * 2 + uniform(random, 0, 0.5f),
                                    static_cast<float>(i % 2) * 2 + uniform(random, 0, 0.5f)));
        }
        const GlobalGrid grid = gridOf(points);
        for (int i = 0; i < 2000; ++i) {
            const glm::vec3 p = across(uniform(random, 0, 1000), uniform(random, 0, 4), uniform(random, 0, 2));
            const GridPlace place = locate(grid, {p.x, p.y, p.z});
            // Within the walk's tolerance, and rounding.
            const double inside = std::ranges::min(barycentric(grid, grid.tetrahedra[place.tetrahedron], p));
            ASSERT_GT(inside, -2e-4) << "axis " << axis << " at " << p[axis] << " m";
        }
    }
}

std::vector<glm::vec3> randomPoints(Random& random) {
    const uint32_t kind = pick(random, 0, 5), count = pick(random, 0, 40);
    const float scale = std::exp2(uniform(random, -6, 9));
    const glm::vec3 offset = scale * glm::vec3(uniform(random, -3, 3), uniform(random, -3, 3), uniform(random, -3, 3));
    const glm::vec3 along = {uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    std::vector<glm::vec3> points(count);
    for (glm::vec3& p : points) {
        const glm::vec3 free = {uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
        const glm::vec3 lattice = {pick(random, 0, 3), pick(random, 0, 2), pick(random, 0, 3)};
        switch (kind) {
            case 0:
                p = free;
                break;
            case 1:
                p = lattice;
                break;  // many on one sphere, many twice
            case 2:
                p = along * free.x;
                break;  // a line, by rounding not quite
            case 3:
                p = {free.x, free.y, free.x + free.y};
                break;  // a plane
            case 4:
                p = along;
                break;  // one point
            default:
                p = lattice + 1e-4f * free;
                break;  // nearly a lattice
        }
        p = offset + scale * p;
    }
    return points;
}

TEST(TetrahedronWalk, OfTenThousandRandomPointSets) {
    Random random(8);
    for (int i = 0; i < 10000; ++i) {
        const auto points = randomPoints(random);
        const GlobalGrid grid = gridOf(points);
        expectTetrahedralisation(grid);
        uint32_t hint = no_tetrahedron;
        for (int query = 0; query < 8; ++query) {
            glm::vec3 p;
            for (int axis = 0; axis < 3; ++axis) {
                const float low = grid.start.min_m[static_cast<size_t>(axis)];
                const float size = grid.start.max_m[static_cast<size_t>(axis)] - low;
                p[axis] = low + size * uniform(random, -0.25f, 1.25f);
            }
            if (query == 7 && !points.empty()) p = points[0];
            expectRightPlace(grid, p, hint);
            hint = pick(random, 0, static_cast<uint32_t>(grid.tetrahedra.size()) - 1);
        }
        ASSERT_FALSE(HasFailure()) << "set " << i;
    }
}

}  // namespace
}  // namespace dimmer::cook
