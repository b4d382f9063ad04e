#include <probes/lit_cells.h>
#include <probes/tetrahedron_walk.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace dimmer {
namespace {

using Point = std::array<double, 3>;

// About so many cells, of at most so many along an axis: 64 kB. A level of 120 x 105 x 35 m has cells of 3 m.
constexpr double cells_aim = 16384;
constexpr double cells_along_max = 64;
// Rows and cells that may be looked at for each tetrahedron and cell, in the mean: of the house's 15,114 tetrahedra a
// fifth of that are.
constexpr size_t looked_at_max = 64;
// Walks take a place in that is outside by this share of a tetrahedron; twice that, for their rounding.
constexpr double outside_max = 2 * double{inside_tolerance};

double determinant(const Point& a, const Point& b, const Point& c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

// The barycentric coordinates of a tetrahedron as planes: coordinate i of a place p is n . p + d.
struct Planes {
    std::array<Point, 4> n = {};
    std::array<double, 4> d = {};
};

// All 0 for a flat tetrahedron.
Planes planesOf(const std::array<Point, 4>& p) {
    Planes planes;
    for (size_t i = 0; i < 4; ++i) {
        const Point& o = p[(i + 1) % 4];
        const auto from = [&](const Point& to) { return Point{to[0] - o[0], to[1] - o[1], to[2] - o[2]}; };
        const Point a = from(p[(i + 2) % 4]), b = from(p[(i + 3) % 4]), apex = from(p[i]);
        const double volume = determinant(apex, a, b);
        if (volume == 0) return {};
        const Point across = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        for (size_t axis = 0; axis < 3; ++axis) {
            planes.n[i][axis] = across[axis] / volume;
            planes.d[i] -= planes.n[i][axis] * o[axis];
        }
    }
    return planes;
}

// Every tetrahedron of each probe, one probe after another; those of probe p are [ends[p - 1], ends[p]).
struct TetrahedraOfProbes {
    explicit TetrahedraOfProbes(const GlobalGrid& grid)
        : starts(grid.positions.size() + 1), numbers(grid.tetrahedra.size() * 4) {
        for (const Tetrahedron& t : grid.tetrahedra)
            for (const uint32_t probe : t.probes) ++starts[probe + 1];
        for (size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
        std::vector<uint32_t> next(starts.begin(), starts.end() - 1);
        for (uint32_t i = 0; i < grid.tetrahedra.size(); ++i)
            for (const uint32_t probe : grid.tetrahedra[i].probes) numbers[next[probe]++] = i;
    }
    std::span<const uint32_t> of(uint32_t probe) const {
        return std::span(numbers).subspan(starts[probe], starts[probe + 1] - starts[probe]);
    }
    std::vector<uint32_t> starts, numbers;
};

}  // namespace

LitCells::LitCells(const PackData& data) {
    const GlobalGrid& grid = data.probes.global;
    double volume_m3 = 1;
    for (size_t axis = 0; axis < 3; ++axis) {
        min_m_[axis] = grid.start.min_m[axis];
        cell_m_[axis] = grid.start.max_m[axis] - min_m_[axis];
        volume_m3 *= cell_m_[axis];
    }
    const double side_m = std::cbrt(volume_m3 / cells_aim);
    for (size_t axis = 0; axis < 3; ++axis) {
        counts_[axis] = static_cast<uint32_t>(std::clamp(std::ceil(cell_m_[axis] / side_m), 1.0, cells_along_max));
        cell_m_[axis] /= counts_[axis];
    }
    changed_in_.resize(size_t{counts_[0]} * counts_[1] * counts_[2]);

    std::vector<Run> runs;
    std::vector<size_t> ends;  // of each tetrahedron's runs, but for those that are everywhere
    size_t left = looked_at_max * (grid.tetrahedra.size() + changed_in_.size());
    for (const Tetrahedron& t : grid.tetrahedra) {
        if (left == 0) break;
        left -= std::min(left, addCellsOf(grid, t, runs));
        ends.push_back(runs.size());
    }
    const TetrahedraOfProbes tetrahedra(grid);
    constexpr uint32_t none = UINT32_MAX;
    std::vector<uint32_t> last_of_tetrahedron(grid.tetrahedra.size(), none), last_of_cell(changed_in_.size(), none);
    for (uint32_t number = 0; number < data.probes.clusters.size(); ++number) {
        const Cluster& cluster = data.probes.clusters[number];
        const auto receivers = std::span(data.probes.numbers).subspan(cluster.first_receiver, cluster.receiver_count);
        const size_t begin = cells_.size();
        everywhere_.push_back(false);
        for (const uint32_t probe : receivers) {
            if (probe >= grid.positions.size()) continue;  // of a local grid
            for (const uint32_t t : tetrahedra.of(probe)) {
                if (t >= ends.size()) everywhere_.back() = true;
                if (everywhere_.back() || std::exchange(last_of_tetrahedron[t], number) == number) continue;
                for (size_t i = t == 0 ? 0 : ends[t - 1]; i < ends[t]; ++i)
                    for (uint32_t cell = runs[i].first; cell < runs[i].first + runs[i].count; ++cell)
                        if (std::exchange(last_of_cell[cell], number) != number) cells_.push_back(cell);
            }
        }
        if (everywhere_.back()) cells_.resize(begin);
        ends_.push_back(static_cast<uint32_t>(cells_.size()));
    }
}

// The cell of a place along an axis, the nearest one outside. What is not a number is in the first.
uint32_t LitCells::along(size_t axis, double place_m) const {
    const double cell = (place_m - min_m_[axis]) / cell_m_[axis];
    return cell > 0 ? static_cast<uint32_t>(std::min(cell, counts_[axis] - 1.0)) : 0;
}

// Those that hold a place which a walk may take for one of the tetrahedron's.
size_t LitCells::addCellsOf(const GlobalGrid& grid, const Tetrahedron& tetrahedron, std::vector<Run>& runs) const {
    std::array<Point, 4> corners;
    for (size_t i = 0; i < 4; ++i) {
        const ProbePosition& p = grid.positions[tetrahedron.probes[i]];
        corners[i] = {p.x_m, p.y_m, p.z_m};
    }
    Cell first, last;
    for (size_t axis = 0; axis < 3; ++axis) {
        const auto [low, high] = std::minmax({corners[0][axis], corners[1][axis], corners[2][axis], corners[3][axis]});
        const double margin_m = outside_max * (high - low);
        first[axis] = along(axis, low - margin_m);
        last[axis] = along(axis, high + margin_m);
    }
    const Planes planes = planesOf(corners);
    // A cell is outside a plane if its furthest place inside is, half its extent from its middle. What is left of a row
    // of cells is one run of them.
    std::array<double, 4> at_first;  // the coordinates there, in the cell at the start of both other axes
    for (size_t i = 0; i < 4; ++i) {
        at_first[i] = planes.d[i] + outside_max;
        for (size_t axis = 0; axis < 3; ++axis) {
            const double middle_m = min_m_[axis] + (first[axis] + 0.5) * cell_m_[axis];
            at_first[i] += planes.n[i][axis] * middle_m + 0.5 * std::abs(planes.n[i][axis]) * cell_m_[axis];
        }
    }
    size_t looked_at = 0;
    for (uint32_t z = first[2]; z <= last[2]; ++z)
        for (uint32_t y = first[1]; y <= last[1]; ++y) {
            ++looked_at;
            double begin = 0, end = last[0] - first[0];  // in cells
            for (size_t i = 0; i < 4; ++i) {
                const double start = at_first[i] + planes.n[i][1] * cell_m_[1] * (y - first[1]) +
                                     planes.n[i][2] * cell_m_[2] * (z - first[2]);
                const double step = planes.n[i][0] * cell_m_[0];
                if (step > 0) {
                    begin = std::max(begin, std::ceil(-start / step));
                } else if (step < 0) {
                    end = std::min(end, std::floor(start / -step));
                } else if (start < 0) {
                    end = -1;
                }
            }
            if (begin > end) continue;
            runs.push_back(
                {numberOf({first[0], y, z}) + static_cast<uint32_t>(begin), static_cast<uint32_t>(end - begin) + 1});
            looked_at += runs.back().count;
        }
    return looked_at;
}

void LitCells::change(uint32_t cluster) {
    if (everywhere_[cluster]) all_changed_in_ = round_;
    const uint32_t begin = cluster == 0 ? 0 : ends_[cluster - 1];
    for (uint32_t i = begin; i < ends_[cluster]; ++i) changed_in_[cells_[i]] = round_;
}

bool LitCells::changedIn(const Box& box) const {
    if (all_changed_in_ == round_) return true;
    Cell first, last;
    for (size_t axis = 0; axis < 3; ++axis) {
        first[axis] = along(axis, box.min_m[axis]);
        last[axis] = along(axis, box.max_m[axis]);
    }
    for (Cell cell = first; cell[2] <= last[2]; ++cell[2])
        for (cell[1] = first[1]; cell[1] <= last[1]; ++cell[1])
            for (cell[0] = first[0]; cell[0] <= last[0]; ++cell[0])
                if (changed_in_[numberOf(cell)] == round_) return true;
    return false;
}

void LitCells::clear() {
    if (++round_ != 0) return;
    std::ranges::fill(changed_in_, 0);  // the count began anew: what is older could look new
    all_changed_in_ = 0;
    round_ = 1;
}

}  // namespace dimmer
