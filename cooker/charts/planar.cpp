#include <charts/planar.h>

#include <charts/box_tree.h>
#include <charts/groups.h>
#include <charts/polygon.h>
#include <charts/raster.h>

#include <tbb/parallel_for.h>

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
constexpr float touching_m = 1e-3f;
// Of the directions of edges, in a quarter of a turn.
constexpr int edge_directions = 360;
// Bilinear filtering and padding reach this far.
constexpr float filter_reach_texels = 2;
// A merged rectangle may waste this much of the page, relative to the two rectangles it replaces.
constexpr float waste_max = 1.3f;
constexpr float waste_free_texels = 16;
// Within one plane, as planeKey() tells them apart, and the normals of its faces: by how much heights over it differ.
constexpr float height_slack_m = 0.02f, height_slack_per_m = 1.0f / 256;
// From the edge of a face towards its middle, where lines to other faces begin.
constexpr float step_in = 0.01f;
// Rays are as exact as coordinates: 8e-6 m at 100 m.
constexpr float ray_slack_m = 1e-4f, ray_slack_per_m = 1e-6f;
// With more than so many things around a face each line between points is asked for.
constexpr size_t shadows_max = 512;
// A surface this high over another one hides it: the points that texels are lit at lie lower (texels.cpp).
constexpr float hiding_m = 5e-4f;

struct Axes {
    glm::vec3 u, v;
    explicit Axes(glm::vec3 n) {
        const glm::vec3 reference = std::abs(n.y) > 0.9f ? glm::vec3(0, 0, -1) : glm::vec3(0, 1, 0);
        u = glm::normalize(glm::cross(reference, n));
        v = glm::cross(n, u);
    }
    // With `along` of these axes as the first one.
    Axes turned(glm::vec2 along) const {
        Axes axes = *this;
        axes.u = glm::normalize(along.x * u + along.y * v);
        axes.v = glm::normalize(along.x * v - along.y * u);
        return axes;
    }
    glm::vec2 on(glm::vec3 p) const { return {glm::dot(p, u), glm::dot(p, v)}; }
};

using PlaneKey = std::tuple<uint32_t, uint32_t, long, long, long, long, long>;

PlaneKey planeKey(const PlanarFace& f) {
    auto step = [](float value, float steps) { return std::lround(value * steps); };
    return {f.group,
            f.region,
            step(f.texels_per_metre, 256),
            step(f.normal.x, normal_steps),
            step(f.normal.y, normal_steps),
            step(f.normal.z, normal_steps),
            step(glm::dot(f.normal, f.corners_m[0]), offset_steps_per_m)};
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

    std::vector<PlanarChart> charts(const Standing& standing) {
        Apart apart = findStacks();
        merge(apart);
        if (standing.blocked && findWalls(standing, apart)) merge(apart);
        std::map<uint32_t, PlanarChart> by_root;
        for (uint32_t i = 0; i < ids_.size(); ++i) {
            const uint32_t root = groups_.find(i);
            auto [it, fresh] = by_root.try_emplace(root);
            if (fresh)
                it->second = {axes_.u, axes_.v, rects_[root].min, rects_[root].max - rects_[root].min, density_, {}};
            it->second.faces.push_back(ids_[i]);
        }
        std::vector<PlanarChart> out;
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
        const float reach = filter_reach_texels / density_;
        std::vector<uint32_t> root(ids_.size());
        for (uint32_t i = 0; i < ids_.size(); ++i) root[i] = groups_.find(i);
        std::vector<std::vector<uint32_t>> beyond_walls(ids_.size());
        if (ids_.size() < 2) return false;
        glm::vec2 largest_m(0);
        for (uint32_t i = 0; i < ids_.size(); ++i) largest_m = glm::max(largest_m, rectOf(i).max - rectOf(i).min);
        // Lines begin so far from where faces end.
        const float look_m = reach + step_in * std::max(largest_m.x, largest_m.y);
        tbb::parallel_for(uint32_t{0}, static_cast<uint32_t>(ids_.size()), [&](uint32_t a) {
            const Walls walls{standing.blocked, standing.triangles ? shadowsNear(a, look_m, standing) : std::nullopt};
            if (walls.shadows && walls.shadows->empty()) return;
            for (const uint32_t b : boxes_.touching(boxOf(a, reach + touching_m)))
                if (a < b && root[a] == root[b] && near(a, b, reach) && walls.mayPart(rectOf(a), rectOf(b)) &&
                    (wallBetween(a, b, reach, walls) || wallBetween(b, a, reach, walls)))
                    beyond_walls[a].push_back(b);
        });
        for (uint32_t a = 0; a < ids_.size(); ++a)
            for (const uint32_t b : beyond_walls[a]) keepApart(apart, a, b);
        return apart.size() > before;
    }

    // What may part faces from one: of all that stands as high as a wall, where it is in the plane; nothing: anywhere.
    struct Walls {
        const std::function<bool(glm::vec3, glm::vec3)>& blocked;
        std::optional<std::vector<Rect>> shadows;

        bool mayPart(Rect a, const Rect& b) const {
            a.add(b);
            return !shadows || std::ranges::any_of(*shadows, [&](const Rect& shadow) { return shadow.touches(a); });
        }
    };

    // Within reach of a face; nothing where there are too many.
    std::optional<std::vector<Rect>> shadowsNear(uint32_t face, float reach, const Standing& standing) const {
        const PlanarFace& f = all_[ids_[face]];
        Rect rect = rectOf(face);
        const float slack_m = height_slack_m + height_slack_per_m * (reach + glm::length(rect.max - rect.min));
        rect.min -= reach, rect.max += reach;
        const glm::vec3 normal = glm::cross(axes_.u, axes_.v);
        const float plane_m = glm::dot(normal, f.corners_m[0]);
        const float low = plane_m + wall_probe_high_m - slack_m, high = plane_m + wall_probe_high_m + slack_m;
        std::vector<glm::vec3> corners;
        for (const float height : {low, high})
            for (const float u : {rect.min.x, rect.max.x})
                for (const float v : {rect.min.y, rect.max.y})
                    corners.push_back(axes_.u * u + axes_.v * v + normal * height);
        std::vector<Rect> shadows;
        for (const auto& triangle : standing.triangles(BoxTree::boxOf(corners))) {
            Rect shadow = shadowBetween(triangle, normal, low, high);
            if (!(shadow.min.x <= shadow.max.x)) continue;
            const glm::vec2 largest = glm::max(glm::abs(shadow.min), glm::abs(shadow.max));
            const float ray_slack = ray_slack_m + ray_slack_per_m * std::max(largest.x, largest.y);
            shadow.min -= ray_slack, shadow.max += ray_slack;
            if (shadow.touches(rect)) shadows.push_back(shadow);
            if (shadows.size() > shadows_max) return std::nullopt;
        }
        return shadows;
    }

    // Where in the plane a triangle is between two heights.
    Rect shadowBetween(const std::array<glm::vec3, 3>& triangle, glm::vec3 normal, float low, float high) const {
        Rect shadow;
        for (size_t i = 0; i < 3; ++i) {
            const glm::vec3 a = triangle[i], b = triangle[(i + 1) % 3];
            const float height_a = glm::dot(normal, a), height_b = glm::dot(normal, b);
            if (height_a >= low && height_a <= high) shadow.add(axes_.on(a));
            for (const float height : {low, high})
                if ((height_a < height) != (height_b < height))
                    shadow.add(axes_.on(glm::mix(a, b, (height - height_a) / (height_b - height_a))));
        }
        return shadow;
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

    bool wallBetween(uint32_t a, uint32_t b, float reach, const Walls& walls) const {
        const PlanarFace& fa = all_[ids_[a]];
        const PlanarFace& fb = all_[ids_[b]];
        auto wallAt = [&](glm::vec3 p, glm::vec3 q, float height_m) {
            const glm::vec3 lift = fa.normal * height_m;
            return walls.blocked(p + lift, q + lift) || walls.blocked(q + lift, p + lift);
        };
        const glm::vec3 middle = (fa.corners_m[0] + fa.corners_m[1] + fa.corners_m[2]) / 3.0f;
        for (size_t e = 0; e < 3; ++e)
            for (float s : {0.02f, 0.25f, 0.5f, 0.75f}) {
                glm::vec3 p = glm::mix(fa.corners_m[e], fa.corners_m[(e + 1) % 3], s);
                glm::vec3 q = nearestOn(fb, p);
                const float distance = glm::length(q - p);
                if (distance < touching_m || distance > reach) continue;
                // Step off the edges, on which the wall itself may stand.
                const glm::vec3 middle_b = (fb.corners_m[0] + fb.corners_m[1] + fb.corners_m[2]) / 3.0f;
                p += step_in * (middle - p);
                q += step_in * (middle_b - q);
                const glm::vec2 on_p = axes_.on(p), on_q = axes_.on(q);
                if (!walls.mayPart({on_p, on_p}, {on_q, on_q})) continue;
                if (wallAt(p, q, wall_probe_low_m) && wallAt(p, q, wall_probe_high_m)) return true;
            }
        return false;
    }

    static glm::vec3 nearestOn(const PlanarFace& f, glm::vec3 p) {
        glm::vec3 best = f.corners_m[0];
        float best2 = 1e30f;
        for (size_t e = 0; e < 3; ++e) {
            const glm::vec3 a = f.corners_m[e], ab = f.corners_m[(e + 1) % 3] - a;
            const float s = std::clamp(glm::dot(p - a, ab) / glm::dot(ab, ab), 0.0f, 1.0f);
            const glm::vec3 q = a + s * ab;
            const float d2 = glm::dot(q - p, q - p);
            if (d2 < best2) best2 = d2, best = q;
        }
        return best;
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

std::vector<PlanarChart> planarCharts(std::span<const PlanarFace> faces, uint32_t side_max_texels,
                                      const Standing& standing) {
    std::map<PlaneKey, std::vector<uint32_t>> planes;
    for (uint32_t i = 0; i < faces.size(); ++i) planes[planeKey(faces[i])].push_back(i);
    std::vector<PlanarChart> charts;
    const auto chart = [&](PlaneGrouper& plane) {
        std::ranges::move(plane.charts(standing), std::back_inserter(charts));
    };
    for (auto& [key, ids] : planes) {
        const Axes axes(faces[ids[0]].normal);
        PlaneGrouper plane(faces, ids, axes, side_max_texels);
        auto turned = plane.turned();
        if (turned.empty()) {
            chart(plane);
            continue;
        }
        std::set<uint32_t> others;
        for (auto& [own_axes, part] : turned) {
            others.insert(part.begin(), part.end());
            PlaneGrouper own(faces, std::move(part), own_axes, side_max_texels);
            chart(own);
        }
        std::erase_if(ids, [&](uint32_t id) { return others.contains(id); });
        if (ids.empty()) continue;
        PlaneGrouper rest(faces, std::move(ids), axes, side_max_texels);
        chart(rest);
    }
    // Neighbours in the file tend to be neighbours in space: keep that order, it is kind to caches.
    std::ranges::sort(charts, {}, [](const PlanarChart& c) { return c.faces[0]; });
    return charts;
}

}  // namespace dimmer::cook
