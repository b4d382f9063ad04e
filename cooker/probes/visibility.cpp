#include <probes/visibility.h>

#include <bake/sampling.h>
#include <probes/obstacles.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace dimmer::cook {
namespace {

// Rows that sort points alike differ in what of the geometry between they take for seen: the face of the wall that is
// nearer to the probe has less, and hides what no point happened to stand at. More than there are such points for each
// that counts, even beyond the level's air.
constexpr uint32_t draw_scale = 16384;
constexpr uint32_t tries_per_sample = 3;
constexpr float off_surface_share = 0.02f;  // of the way to a probe
constexpr float same_plane_m = 1e-4f;
constexpr uint32_t leak_cost = 3, miss_cost = 1;
constexpr uint32_t lonely_miss_cost = 8;  // of a point that no other probe is taken to see
// Beyond the box of the level's air, over which the grid's own reaches, hardly anyone asks for light: points there
// count so many times less, and decide where there are no others. That somebody may stand on the highest roof is not
// worth it: with 2 m of air counted there, a wall of two_rooms lets light through in three of fourteen placements.
constexpr uint32_t beyond_share = 16;
constexpr std::array<int8_t, 4> seen_everywhere = {127, 127, 127, 127};
constexpr std::array<int8_t, 4> seen_nowhere = {-127, -127, -127, -127};

using Weights = Barycentric;

// Evenly over the tetrahedron: the unit cube folded onto it (Rocchini and Cignoni 2000).
Weights pointInside(glm::vec3 u) {
    if (u.x + u.y > 1) u = {1 - u.x, 1 - u.y, u.z};
    if (u.y + u.z > 1)
        u = {u.x, 1 - u.z, 1 - u.x - u.y};
    else if (u.x + u.y + u.z > 1)
        u = {1 - u.y - u.z, u.y, u.x + u.y + u.z - 1};
    return {1 - u.x - u.y - u.z, u.x, u.y, u.z};
}

float value(const Weights& field, const Weights& at) {
    return field[0] * at[0] + field[1] * at[1] + field[2] * at[2] + field[3] * at[3];
}

std::array<int8_t, 4> quantised(const Weights& field) {
    float largest = 0;
    for (const float f : field) largest = std::max(largest, std::abs(f));
    std::array<int8_t, 4> out;
    // Rounded down: what is hidden stays hidden.
    for (size_t i = 0; i < 4; ++i) out[i] = static_cast<int8_t>(std::floor(127 * field[i] / largest));
    return out;
}

float value(const std::array<int8_t, 4>& row, const Weights& at) {
    return value(Weights{static_cast<float>(row[0]), static_cast<float>(row[1]), static_cast<float>(row[2]),
                         static_cast<float>(row[3])},
                 at);
}

// Towards the corners and between them, where a wall can part what few points all over would miss.
constexpr uint32_t corner_samples = 10;
constexpr float corner_share = 0.94f, edge_share = 0.47f, other_share = 0.02f, off_edge_share = 0.03f;

std::array<Weights, corner_samples> pointsAtCorners() {
    std::array<Weights, corner_samples> points;
    size_t n = 0;
    for (size_t a = 0; a < 4; ++a) {
        points[n].fill(other_share);
        points[n++][a] = corner_share;
        for (size_t b = 0; b < a; ++b) {
            points[n].fill(off_edge_share);
            points[n][a] = points[n][b] = edge_share;
            ++n;
        }
    }
    return points;
}

// One worker's scratch, for one tetrahedron after another.
class Table {
   public:
    TetrahedronVisibility find(const RayScene& rays, const Box& air, const Obstacles& obstacles,
                               const std::array<bool, 4>& free, std::span<const Weights> places, uint32_t points) {
        clear();
        rays_ = &rays;
        air_ = air;
        obstacles_ = &obstacles;
        free_ = free;
        for (const Weights& w : pointsAtCorners()) look(w);
        for (uint32_t i = 0; i < tries_per_sample * points && points_.size() - besides_ < corner_samples + points; ++i)
            look(pointInside(sequence3d(i, 1)));
        const size_t step = places.size() / points + 1;
        for (size_t i = 0; i < places.size(); i += step) look(places[i]);
        return findHere();
    }

   private:
    void clear() {
        points_.clear();
        buried_.clear();
        besides_ = 0;
        planes_.clear();
        numbers_.clear();
        for (auto& rows : rows_) rows.clear();
    }

    TetrahedronVisibility findHere() {
        TetrahedronVisibility out;
        lendUnseen();
        findRows();
        group();
        for (size_t v = 0; v < 4; ++v) out.seen[v] = bestRow(v);
        if (!markLonely(out)) return out;
        group();
        for (size_t v = 0; v < 4; ++v) out.seen[v] = bestRow(v);
        return out;
    }

    struct Point {
        Weights at;
        std::array<bool, 4> seen = {};
        uint32_t scale = draw_scale;  // of its costs
        std::array<uint32_t, 4> miss = {miss_cost, miss_cost, miss_cost, miss_cost};
        std::array<uint32_t, 4> plane = {};  // that hides it from each probe
    };

    // From the point to the probes. Where none is seen, but backs are, the point lies in geometry or outside of the
    // level, and nobody will ask for it.
    void look(const Weights& w, bool surfaces = true) {
        Point point{w};
        uint32_t hidden = 0, backs = 0;
        const auto found = obstacles_->from(w, free_);
        for (size_t v = 0; v < 4; ++v) {
            if (!free_[v]) continue;
            point.seen[v] = !found[v].any;
            if (point.seen[v]) continue;
            ++hidden;
            const auto& first = rays_->triangles()[found[v].first];
            backs += found[v].back && !rays_->scene().materials[first.material].double_sided;
            point.plane[v] = numberOf(found[v].first);
            if (found[v].last != found[v].first) numberOf(found[v].last);
        }
        const bool open = 2 * backs <= hidden || point.seen != std::array<bool, 4>{};
        if (open && !isInAir(w)) {
            point.scale = draw_scale / beyond_share;
            ++besides_;
        }
        (open ? points_ : buried_).push_back(point);
        if (!open && surfaces) lookAtSurface(w, found);
    }

    bool isInAir(const Weights& w) const {
        const glm::vec3 p = obstacles_->position(w);
        return p == glm::clamp(p, air_.min_m, air_.max_m);
    }

    // From where ways to the probes come out of geometry: what is open of a tetrahedron that lies below the floor for
    // the most part is a thin slice.
    void lookAtSurface(const Weights& w, const std::array<Obstacle, 4>& found) {
        for (size_t v = 0; v < 4; ++v) {
            if (!found[v].any || !found[v].back) continue;
            const float share = found[v].share + off_surface_share;
            if (share >= 1) continue;
            Weights out;
            for (size_t k = 0; k < 4; ++k) out[k] = (1 - share) * w[k] + (k == v ? share : 0);
            const size_t before = points_.size() - besides_;
            look(out, false);
            besides_ += points_.size() - besides_ - before;
        }
    }

    // 1 and up, of planes_.
    uint32_t numberOf(uint32_t triangle) {
        const auto known = std::ranges::find(numbers_, triangle, &std::pair<uint32_t, uint32_t>::first);
        if (known != numbers_.end()) return known->second;
        numbers_.emplace_back(triangle, findNumber(triangle));
        return numbers_.back().second;
    }
    uint32_t findNumber(uint32_t triangle) {
        const Weights field = obstacles_->field(triangle);
        const auto same = [&](const Weights& other) {
            for (size_t k = 0; k < 4; ++k)
                if (std::abs(other[k] - field[k]) > same_plane_m) return false;
            return true;
        };
        for (uint32_t i = 0; i < planes_.size(); ++i)
            if (same(planes_[i])) return i + 1;
        planes_.push_back(field);
        return static_cast<uint32_t>(planes_.size());
    }

    // Points that no probe sees belong to those that stand on their side of most of what hides them from others: the
    // light there is more like theirs than like that behind the wall. Corners of the box that see nothing, too.
    void lendUnseen() {
        for (Point& point : points_) {
            if (point.seen != std::array<bool, 4>{}) continue;
            std::array<uint32_t, 4> same_side{};
            for (size_t v = 0; v < 4; ++v) {
                if (point.plane[v] == 0) continue;
                const Weights& field = planes_[point.plane[v] - 1];
                const bool beyond = value(field, point.at) > 0;
                for (size_t u = 0; u < 4; ++u) same_side[u] += (field[u] > 0) == beyond;
            }
            const uint32_t most = std::ranges::max(same_side);
            for (size_t u = 0; u < 4; ++u) point.seen[u] = most > 0 && same_side[u] == most;
        }
    }

    // Each plane, positive on the probe's side.
    void findRows() {
        for (size_t v = 0; v < 4; ++v)
            for (Weights field : planes_) {
                if (field[v] < 0)
                    for (float& d : field) d = -d;
                if (field[v] > 0) rows_[v].push_back(quantised(field));
            }
    }

    // Points as cost() reads them, eight at a time: most of the work is there.
    void group() {
        points_grouped_.assign((points_.size() + lanes - 1) / lanes, {});
        for (size_t i = 0; i < points_.size(); ++i) {
            Group& g = points_grouped_[i / lanes];
            for (size_t k = 0; k < 4; ++k) {
                g.at[k][i % lanes] = points_[i].at[k];
                g.seen[k][i % lanes] = points_[i].seen[k] ? -1 : 0;
                g.miss[k][i % lanes] = static_cast<int>(points_[i].scale * points_[i].miss[k]);
            }
            g.leak[i % lanes] = static_cast<int>(points_[i].scale * leak_cost);
        }
        buried_grouped_.assign((buried_.size() + lanes - 1) / lanes, {});
        for (size_t i = 0; i < buried_.size(); ++i)
            for (size_t k = 0; k < 4; ++k) buried_grouped_[i / lanes].at[k][i % lanes] = buried_[i].at[k];
    }

    uint32_t cost(size_t v, const std::array<int8_t, 4>& row) const {
        std::array<float, 4> field;
        for (size_t k = 0; k < 4; ++k) field[k] = static_cast<float>(row[k]);
        IntLanes sum{}, taken_for_seen{};
        const auto take = [&](const Group& g) {
            taken_for_seen = g.at[0] * field[0] + g.at[1] * field[1] + g.at[2] * field[2] + g.at[3] * field[3] > 0;
        };
        for (const Group& g : points_grouped_) {
            take(g);
            sum += ((taken_for_seen & g.leak) | (~taken_for_seen & g.miss[v])) & (taken_for_seen ^ g.seen[v]);
        }
        for (const Group& g : buried_grouped_) {
            take(g);
            sum -= taken_for_seen;  // -1 each
        }
        uint32_t all = 0;
        for (size_t lane = 0; lane < lanes; ++lane) all += static_cast<uint32_t>(sum[lane]);
        return all;
    }

    std::array<int8_t, 4> bestRow(size_t v) const {
        std::array<int8_t, 4> best = seen_everywhere;
        uint32_t least = cost(v, best);
        const auto consider = [&](const std::array<int8_t, 4>& row) {
            const uint32_t c = cost(v, row);
            if (c < least) least = c, best = row;
        };
        if (least == 0) return best;
        consider(seen_nowhere);
        for (const auto& row : rows_[v]) consider(row);
        return best;
    }

    // Points that some probe sees and none is taken to see count more from now on.
    bool markLonely(const TetrahedronVisibility& table) {
        bool any = false;
        for (Point& point : points_) {
            bool taken = false;
            for (size_t v = 0; v < 4; ++v) taken = taken || value(table.seen[v], point.at) > 0;
            for (size_t v = 0; v < 4 && !taken; ++v)
                if (point.seen[v]) {
                    point.miss[v] = lonely_miss_cost;
                    any = true;
                }
        }
        return any;
    }

    static constexpr size_t lanes = 8;
    using Lanes [[gnu::vector_size(32)]] = float;
    using IntLanes [[gnu::vector_size(32)]] = int;
    // No points: at no place, seen by none, so that they cost nothing.
    struct Group {
        std::array<Lanes, 4> at{};
        std::array<IntLanes, 4> seen{}, miss{};  // seen: all bits or none
        IntLanes leak{};
    };

    const RayScene* rays_ = nullptr;
    Box air_;
    const Obstacles* obstacles_ = nullptr;
    std::array<bool, 4> free_ = {};
    std::vector<Point> points_, buried_;
    size_t besides_ = 0;  // of points_, at surfaces or beyond the air
    std::vector<Group> points_grouped_, buried_grouped_;
    std::vector<Weights> planes_;                         // that stopped rays
    std::vector<std::pair<uint32_t, uint32_t>> numbers_;  // triangle, the number of its plane
    std::array<std::vector<std::array<int8_t, 4>>, 4> rows_;
};

}  // namespace

TetrahedronVisibility findVisibility(const RayScene& rays, const Box& air, const std::array<glm::vec3, 4>& corners,
                                     const std::array<bool, 4>& free, std::span<const std::array<float, 4>> places,
                                     const TriangleCells* cells, uint32_t points) {
    const Obstacles obstacles(rays, cells, corners);
    if (!obstacles.none()) {
        thread_local Table table;
        return table.find(rays, air, obstacles, free, places, points);
    }
    TetrahedronVisibility out;
    for (size_t v = 0; v < 4; ++v) out.seen[v] = free[v] ? seen_everywhere : seen_nowhere;
    return out;
}

}  // namespace dimmer::cook
