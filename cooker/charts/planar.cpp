#include <charts/planar.h>

#include <charts/box_tree.h>
#include <charts/face_walls.h>
#include <charts/groups.h>
#include <charts/polygon.h>
#include <charts/raster.h>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>

namespace dimmer::cook {
namespace {

// Planes and lines are told apart at these steps: finer than any texel, coarser than 32-bit coordinates at 100 m.
constexpr float normal_steps = 512, offset_steps_per_m = 128, direction_steps = 2048;
// Of the directions of edges, in a quarter of a turn.
constexpr int edge_directions = 360;
// A merged rectangle may waste this much of the page, relative to the two rectangles it replaces.
constexpr float waste_max = 1.3f;
constexpr float waste_free_texels = 16;

// Normal and offset, in steps.
using Plane = std::array<long, 4>;

Plane planeOf(const PlanarFace& f) {
    const auto step = [](float value, float steps) { return std::lround(value * steps); };
    return {step(f.normal.x, normal_steps), step(f.normal.y, normal_steps), step(f.normal.z, normal_steps),
            step(glm::dot(f.normal, f.corners_m[0]), offset_steps_per_m)};
}

using PlaneKey = std::tuple<uint32_t, uint32_t, long, Plane>;

PlaneKey planeKey(const PlanarFace& f) {
    return {f.group, f.region, std::lround(f.texels_per_metre * 256), planeOf(f)};
}

struct Contact {
    float length_m;
    uint32_t a, b;  // positions within the plane's list
};

// Faces that must not share a chart; each pair both ways round.
using Apart = std::set<std::pair<uint32_t, uint32_t>>;

void keepApart(Apart& apart, uint32_t a, uint32_t b) {
    apart.insert({a, b});
    apart.insert({b, a});
}

// Charts of one plane: a union-find over its faces.
class PlaneGrouper {
   public:
    PlaneGrouper(std::span<const PlanarFace> all, std::vector<uint32_t> ids, const Axes& axes, uint32_t side_max_texels)
        : all_(all),
          ids_(std::move(ids)),
          axes_(axes),
          density_(all[ids_[0]].texels_per_metre),
          side_max_(static_cast<float>(side_max_texels) / density_) {
        for (uint32_t id : ids_) {
            std::array<glm::vec2, 3> flat;
            for (size_t i = 0; i < 3; ++i) flat[i] = axes_.on(all_[id].corners_m[i]);
            flat_.push_back(flat);
        }
        std::vector<BoxTree::Box> boxes;
        for (uint32_t i = 0; i < ids_.size(); ++i) boxes.push_back(boxOf(i, 0));
        boxes_ = BoxTree(std::move(boxes));
        findContacts();
    }

    std::vector<ProjectedChart> charts(const Standing& standing) {
        Apart apart = findStacks();
        merge(apart);
        if (standing.blocked && findWalls(standing, apart)) merge(apart);
        std::map<uint32_t, ProjectedChart> by_root;
        for (uint32_t i = 0; i < ids_.size(); ++i) {
            const uint32_t root = groups_.find(i);
            auto [it, fresh] = by_root.try_emplace(root);
            if (fresh)
                it->second = {axes_.u, axes_.v, rects_[root].min, rects_[root].max - rects_[root].min, density_,
                              {},      false};
            it->second.faces.push_back(ids_[i]);
        }
        std::vector<ProjectedChart> out;
        for (auto& [root, chart] : by_root) out.push_back(std::move(chart));
        return out;
    }

    // Faces that hang together and whose edges lie along other axes than these: a building that is turned. Each with
    // the axes that are theirs.
    std::vector<std::pair<Axes, std::vector<uint32_t>>> turned() {
        groups_ = Groups(ids_.size());
        for (const Contact& c : contacts_) {
            const uint32_t a = groups_.find(c.a), b = groups_.find(c.b);
            if (a != b) groups_.join(a, b);
        }
        std::map<uint32_t, std::vector<uint32_t>> parts;
        for (uint32_t i = 0; i < ids_.size(); ++i) parts[groups_.find(i)].push_back(i);
        std::vector<std::pair<Axes, std::vector<uint32_t>>> found;
        for (auto& [root, part] : parts) {
            const auto along = alongEdges(part);
            if (!along) continue;
            for (uint32_t& i : part) i = ids_[i];
            found.emplace_back(axes_.turned(*along), std::move(part));
        }
        return found;
    }

   private:
    // The direction, up to right angles, that more than half of these faces' outer edges have, by length (a square's
    // diagonals are as good as its sides); empty where there is none, or it is the axes'.
    std::optional<glm::vec2> alongEdges(std::span<const uint32_t> part) const {
        using Edge = std::array<float, 4>;
        const auto edge = [&](uint32_t i, size_t from, size_t to) {
            return Edge{flat_[i][from].x, flat_[i][from].y, flat_[i][to].x, flat_[i][to].y};
        };
        std::set<Edge> edges;
        for (const uint32_t i : part)
            for (size_t e = 0; e < 3; ++e) edges.insert(edge(i, e, (e + 1) % 3));
        std::array<float, edge_directions> length{}, longest{};
        std::array<glm::vec2, edge_directions> direction;
        for (const uint32_t i : part)
            for (size_t e = 0; e < 3; ++e) {
                if (edges.contains(edge(i, (e + 1) % 3, e))) continue;
                glm::vec2 d = flat_[i][(e + 1) % 3] - flat_[i][e];
                const float edge_m = glm::length(d);
                if (edge_m < touching_m) continue;
                d /= edge_m;
                while (!(d.x > 0 && d.y >= 0)) d = {-d.y, d.x};
                const float turn = std::atan2(d.y, d.x) / (0.5f * std::numbers::pi_v<float>);
                const auto at = static_cast<size_t>(std::lround(turn * edge_directions)) % edge_directions;
                length[at] += edge_m;
                if (edge_m <= longest[at]) continue;
                longest[at] = edge_m;
                direction[at] = d;
            }
        const auto most = static_cast<size_t>(std::ranges::max_element(length) - length.begin());
        const float all = std::accumulate(length.begin(), length.end(), 0.0f);
        return 2 * length[most] <= all || most == 0 ? std::nullopt : std::optional(direction[most]);
    }

    // Edges that lie on one line and overlap with opposite directions: shared edges, T-junctions included.
    void findContacts() {
        struct Edge {
            float from, to;
            bool forward;
            uint32_t face;
        };
        std::map<std::tuple<long, long, long>, std::vector<Edge>> lines;
        for (uint32_t i = 0; i < flat_.size(); ++i)
            for (size_t e = 0; e < 3; ++e) {
                const glm::vec2 a = flat_[i][e], b = flat_[i][(e + 1) % 3];
                const float length = glm::length(b - a);
                if (length < touching_m) continue;
                glm::vec2 d = (b - a) / length;
                const long qx = std::lround(d.x * direction_steps);
                const bool forward = qx > 0 || (qx == 0 && d.y > 0);
                if (!forward) d = -d;
                const float offset = d.x * a.y - d.y * a.x;
                const float ta = glm::dot(d, a), tb = glm::dot(d, b);
                lines[{std::lround(d.x * direction_steps), std::lround(d.y * direction_steps),
                       std::lround(offset * offset_steps_per_m)}]
                    .push_back({std::min(ta, tb), std::max(ta, tb), forward, i});
            }
        for (auto& [key, edges] : lines) {
            std::ranges::sort(edges, {}, [](const Edge& e) { return std::tuple(e.from, e.to, e.face, e.forward); });
            for (size_t a = 0; a < edges.size(); ++a)
                for (size_t b = a + 1; b < edges.size() && edges[b].from < edges[a].to - touching_m; ++b) {
                    const float overlap = std::min(edges[a].to, edges[b].to) - edges[b].from;
                    if (edges[a].forward != edges[b].forward && overlap > touching_m)
                        contacts_.push_back({overlap, edges[a].face, edges[b].face});
                }
        }
        std::ranges::sort(contacts_, {}, [](const Contact& c) { return std::tuple(-c.length_m, c.a, c.b); });
    }

    // Longest contacts first, so that a doorway's strip joins one room rather than joining two rooms.
    void merge(const Apart& apart) {
        groups_ = Groups(ids_.size());
        for (const auto& [a, b] : apart) groups_.keepApart(a, b);
        rects_.resize(ids_.size());
        for (uint32_t i = 0; i < ids_.size(); ++i) rects_[i] = rectOf(i);
        for (const Contact& c : contacts_) {
            const uint32_t a = groups_.find(c.a), b = groups_.find(c.b);
            if (a == b || !fitsTogether(a, b) || groups_.areApart(a, b)) continue;
            const auto [whole, part] = groups_.join(a, b);
            rects_[whole].add(rects_[part]);
        }
    }

    bool fitsTogether(uint32_t a, uint32_t b) const {
        Rect r = rects_[a];
        r.add(rects_[b]);
        const glm::vec2 size = r.max - r.min;
        if (std::max(size.x, size.y) > side_max_) return false;
        return r.area() <=
               waste_max * (rects_[a].area() + rects_[b].area()) + waste_free_texels / (density_ * density_);
    }

    // Pairs of faces of which one lies over the other, as a rug on a floor does. In one chart they would have the same
    // texels, and what hides the lower one would make them black.
    Apart findStacks() const {
        std::vector<Rect> rects(ids_.size());
        for (uint32_t i = 0; i < ids_.size(); ++i) rects[i] = rectOf(i);
        const auto place = [&](uint32_t i) { return std::pair(rects[i].min.x, i); };
        Apart stacks;
        for (uint32_t a = 0; a < ids_.size(); ++a)
            for (const uint32_t b : boxes_.touching(boxOf(a, 0))) {
                if (place(b) <= place(a) || rects[b].min.x >= rects[a].max.x) continue;
                if (rects[a].min.y >= rects[b].max.y || rects[b].min.y >= rects[a].max.y) continue;
                if (liesOff(a, b) && liesOff(b, a) && !edgeParts(a, b) && !edgeParts(b, a)) keepApart(stacks, a, b);
            }
        return stacks;
    }

    // Whether all of `a` is on one side of b's plane, too far off to be lit as if it were in it.
    bool liesOff(uint32_t a, uint32_t b) const {
        const PlanarFace& plane = all_[ids_[b]];
        float low = 1e30f, high = -1e30f;
        for (glm::vec3 p : all_[ids_[a]].corners_m) {
            const float d = glm::dot(plane.normal, p - plane.corners_m[0]);
            low = std::min(low, d), high = std::max(high, d);
        }
        return low > hiding_m || high < -hiding_m;
    }

    // Whether `b` lies beyond an edge of `a`, but for the width of an edge.
    bool edgeParts(uint32_t a, uint32_t b) const {
        for (size_t e = 0; e < 3; ++e) {
            const glm::vec2 from = flat_[a][e], along = glm::normalize(flat_[a][(e + 1) % 3] - from);
            if (std::ranges::all_of(flat_[b], [&](glm::vec2 p) { return cross2d(along, p - from) < touching_m; }))
                return true;
        }
        return false;
    }

    // Adds the pairs of faces of one chart that come within the filter's reach of one another with a wall between.
    bool findWalls(const Standing& standing, Apart& apart) {
        const size_t before = apart.size();
        if (ids_.size() < 2) return false;
        FaceWalls::Reach reach{filter_reach_texels / density_, 0, 0, 0};
        std::vector<uint32_t> root(ids_.size());
        for (uint32_t i = 0; i < ids_.size(); ++i) {
            root[i] = groups_.find(i);
            const glm::vec2 size_m = rectOf(i).max - rectOf(i).min;
            reach.largest_m = std::max({reach.largest_m, size_m.x, size_m.y});
        }
        std::vector<std::vector<uint32_t>> beyond_walls(ids_.size());
        const auto look = [&](uint32_t a) {
            const FaceWalls walls(all_[ids_[a]], axes_, reach, standing);
            if (walls.none()) return;
            for (const uint32_t b : boxes_.touching(boxOf(a, reach.near_m + touching_m)))
                if (a < b && root[a] == root[b] && near(a, b, reach.near_m) && walls.part(all_[ids_[b]]))
                    beyond_walls[a].push_back(b);
        };
        // While it waits a thread takes no other plane on top of this one.
        tbb::this_task_arena::isolate(
            [&] { tbb::parallel_for(uint32_t{0}, static_cast<uint32_t>(ids_.size()), look); });
        for (uint32_t a = 0; a < ids_.size(); ++a)
            for (const uint32_t b : beyond_walls[a]) keepApart(apart, a, b);
        return apart.size() > before;
    }

    // In the plane, and so much more to each side.
    BoxTree::Box boxOf(uint32_t face, float more_m) const {
        const Rect rect = rectOf(face);
        return {{rect.min - more_m, 0}, {rect.max + more_m, 0}};
    }

    Rect rectOf(uint32_t face) const {
        Rect rect;
        for (glm::vec2 p : flat_[face]) rect.add(p);
        return rect;
    }

    bool near(uint32_t a, uint32_t b, float reach) const {
        const Rect ra = rectOf(a), rb = rectOf(b);
        return glm::all(glm::lessThan(ra.min, rb.max + reach)) && glm::all(glm::lessThan(rb.min, ra.max + reach));
    }

    std::span<const PlanarFace> all_;
    std::vector<uint32_t> ids_;
    Axes axes_;
    float density_, side_max_;
    std::vector<std::array<glm::vec2, 3>> flat_;
    BoxTree boxes_;  // of the faces, in the plane
    std::vector<Contact> contacts_;
    Groups groups_{0};
    std::vector<Rect> rects_;
};

}  // namespace

bool inOnePlane(const PlanarFace& a, const PlanarFace& b) {
    return planeOf(a) == planeOf(b);
}

std::vector<ProjectedChart> planarCharts(std::span<const PlanarFace> faces, uint32_t side_max_texels,
                                         const Standing& standing) {
    std::map<PlaneKey, std::vector<uint32_t>> by_plane;
    for (uint32_t i = 0; i < faces.size(); ++i) by_plane[planeKey(faces[i])].push_back(i);
    std::vector<std::vector<uint32_t>> planes;
    for (auto& [key, ids] : by_plane) planes.push_back(std::move(ids));
    std::vector<std::vector<ProjectedChart>> of_plane(planes.size());
    tbb::parallel_for(size_t{0}, planes.size(), [&](size_t p) {
        const auto chart = [&](PlaneGrouper& plane) {
            std::ranges::move(plane.charts(standing), std::back_inserter(of_plane[p]));
        };
        std::vector<uint32_t>& ids = planes[p];
        const Axes axes(faces[ids[0]].normal);
        PlaneGrouper plane(faces, ids, axes, side_max_texels);
        auto turned = plane.turned();
        if (turned.empty()) return chart(plane);
        std::set<uint32_t> others;
        for (auto& [own_axes, part] : turned) {
            others.insert(part.begin(), part.end());
            PlaneGrouper own(faces, std::move(part), own_axes, side_max_texels);
            chart(own);
        }
        std::erase_if(ids, [&](uint32_t id) { return others.contains(id); });
        if (ids.empty()) return;
        PlaneGrouper rest(faces, std::move(ids), axes, side_max_texels);
        chart(rest);
    });
    std::vector<ProjectedChart> charts;
    for (auto& found : of_plane) std::ranges::move(found, std::back_inserter(charts));
    // Neighbours in the file tend to be neighbours in space: keep that order, it is kind to caches.
    std::ranges::sort(charts, {}, [](const ProjectedChart& c) { return c.faces[0]; });
    return charts;
}

}  // namespace dimmer::cook
