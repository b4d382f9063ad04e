#include <probes/tetrahedra.h>

#include <probes/tetrahedron_walk.h>

#include <tetgen.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace dimmer::cook {
namespace {

constexpr float coordinate_max_m = 1e6f;
// Closer probes see the same light, and their tetrahedra are too thin for 32-bit floats to tell inside from outside.
constexpr float merge_distance_m = 1e-3f;
constexpr size_t starts_max = 1 << 18;  // 1 MiB

ProbePosition positionOf(const glm::vec3& p) {
    return {p.x, p.y, p.z};
}
glm::dvec3 vectorOf(const ProbePosition& p) {
    return {p.x_m, p.y_m, p.z_m};
}

// Around everything, with a margin that is large beside what a float can tell apart there.
Box enclose(std::span<const glm::vec3> points, Box box) {
    for (const glm::vec3& p : points) {
        box.min_m = glm::min(box.min_m, p);
        box.max_m = glm::max(box.max_m, p);
    }
    const glm::vec3 largest = glm::max(glm::abs(box.min_m), glm::abs(box.max_m));
    const glm::vec3 margin = glm::max(glm::vec3(0.25f), 1e-3f * largest);
    return {box.min_m - margin, box.max_m + margin};
}

glm::vec3 corner(const Box& box, int i) {
    return {i & 1 ? box.max_m.x : box.min_m.x, i & 2 ? box.max_m.y : box.min_m.y, i & 4 ? box.max_m.z : box.min_m.z};
}

// The points that stand far enough from all earlier ones.
class Merger {
   public:
    bool add(const glm::vec3& p) {
        const glm::i64vec3 cell = cellOf(p);
        for (int64_t i = 0; i < 27; ++i) {
            const auto range = cells_.equal_range(keyOf(cell + glm::i64vec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
            for (auto it = range.first; it != range.second; ++it)
                if (glm::distance(it->second, p) < merge_distance_m) return false;
        }
        cells_.emplace(keyOf(cell), p);
        return true;
    }

   private:
    static glm::i64vec3 cellOf(const glm::vec3& p) { return glm::floor(glm::dvec3(p) / double{merge_distance_m}); }
    static uint64_t keyOf(const glm::i64vec3& c) {
        const glm::u64vec3 u(c);
        return u.x * 0x9e3779b97f4a7c15u ^ u.y * 0xc2b2ae3d27d4eb4fu ^ u.z * 0x165667b19e3779f9u;
    }
    std::unordered_multimap<uint64_t, glm::vec3> cells_;
};

// Numbers of the positions that become corners of tetrahedra; the box's always do.
std::vector<uint32_t> distinct(std::span<const ProbePosition> positions) {
    std::vector<uint32_t> numbers;
    Merger merger;
    const auto consider = [&](size_t i) {
        if (merger.add(glm::vec3(vectorOf(positions[i])))) numbers.push_back(static_cast<uint32_t>(i));
    };
    const size_t points = positions.size() - 8;
    for (size_t i = points; i < positions.size(); ++i) consider(i);
    for (size_t i = 0; i < points; ++i) consider(i);
    return numbers;
}

double volume(const GlobalGrid& grid, const Tetrahedron& t) {
    const glm::dvec3 a = vectorOf(grid.positions[t.probes[0]]), b = vectorOf(grid.positions[t.probes[1]]);
    const glm::dvec3 c = vectorOf(grid.positions[t.probes[2]]), d = vectorOf(grid.positions[t.probes[3]]);
    return glm::dot(b - a, glm::cross(c - a, d - a));
}

Expected<void> fillTetrahedra(GlobalGrid& grid) {
    const std::vector<uint32_t> numbers = distinct(grid.positions);
    tetgenio in, out;
    in.numberofpoints = static_cast<int>(numbers.size());
    in.pointlist = new REAL[3 * numbers.size()];  // tetgenio frees it
    for (size_t i = 0; i < numbers.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            in.pointlist[3 * i + static_cast<size_t>(axis)] = vectorOf(grid.positions[numbers[i]])[axis];
    std::string switches = "nQ";  // with neighbours, quiet
    try {
        ::tetrahedralize(switches.data(), &in, &out);
    } catch (int code) {
        return fail(ErrorCode::Internal,
                    fmt::format("TetGen gave up on {} probes with code {}.", numbers.size(), code));
    }
    for (int i = 0; i < out.numberoftetrahedra; ++i) {
        Tetrahedron t;
        for (size_t corner = 0; corner < 4; ++corner) {
            const size_t at = 4 * static_cast<size_t>(i) + corner;
            t.probes[corner] = numbers[static_cast<size_t>(out.tetrahedronlist[at])];
            const int neighbour = out.neighborlist[at];
            t.neighbours[corner] = neighbour < 0 ? no_tetrahedron : static_cast<uint32_t>(neighbour);
        }
        if (volume(grid, t) < 0) {
            std::swap(t.probes[2], t.probes[3]);
            std::swap(t.neighbours[2], t.neighbours[3]);
        }
        grid.tetrahedra.push_back(t);
    }
    return {};
}

// About as many cells as probes, as close to cubes as that allows.
void fillStarts(const Box& box, GlobalGrid& grid) {
    const glm::dvec3 size = glm::dvec3(box.max_m) - glm::dvec3(box.min_m);
    const auto wanted = static_cast<double>(std::min(grid.positions.size(), starts_max));
    const double side = std::cbrt(size.x * size.y * size.z / wanted);
    StartGrid& start = grid.start;
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<size_t>(axis);
        start.min_m[i] = box.min_m[axis];
        start.max_m[i] = box.max_m[axis];
        start.counts[i] = static_cast<uint32_t>(std::clamp(std::floor(size[axis] / side), 1.0, wanted));
    }
    // Found by walks of their own, each from where the one before ended; until all are there, all begin at 0. From
    // there a row of cells may begin a kilometre away, which no walk is cut short for.
    const auto steps_max = static_cast<uint32_t>(grid.tetrahedra.size());
    const auto [nx, ny, nz] = start.counts;
    std::vector<uint32_t> starts;
    grid.starts.assign(size_t{nx} * ny * nz, 0);
    uint32_t hint = 0;
    for (uint32_t cell = 0; cell < grid.starts.size(); ++cell) {
        const glm::dvec3 at = (glm::dvec3(cell % nx, cell / nx % ny, cell / nx / ny) + 0.5) / glm::dvec3(nx, ny, nz);
        const glm::vec3 centre = glm::dvec3(box.min_m) + at * size;
        hint = locate(grid, {centre.x, centre.y, centre.z}, hint, steps_max).tetrahedron;
        starts.push_back(hint);
    }
    grid.starts = std::move(starts);
}

}  // namespace

Expected<GlobalGrid> tetrahedralise(std::span<const glm::vec3> points, const Box& level) {
    const auto usable = [](const glm::vec3& p) {  // so written that NaN is not
        return std::abs(p.x) <= coordinate_max_m && std::abs(p.y) <= coordinate_max_m &&
               std::abs(p.z) <= coordinate_max_m;
    };
    if (!usable(level.min_m) || !usable(level.max_m) || !std::ranges::all_of(points, usable))
        return fail(ErrorCode::InvalidArgument, "Probes cannot stand more than 1000 km from the level's origin.");
    const Box box = enclose(points, level);
    GlobalGrid grid;
    for (const glm::vec3& p : points) grid.positions.push_back(positionOf(p));
    for (int i = 0; i < 8; ++i) grid.positions.push_back(positionOf(corner(box, i)));
    grid.levels.assign(grid.positions.size(), 0);
    if (auto ok = fillTetrahedra(grid); !ok) return std::unexpected(ok.error());
    fillStarts(box, grid);
    return grid;
}

}  // namespace dimmer::cook
