#include <charts/curved.h>

#include <charts/chart_faults.h>
#include <charts/groups.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <tuple>

namespace dimmer::cook {
namespace {

// Off a chart's normal faces are stored so much coarser along one axis: 0.87 at 30 degrees.
constexpr float tilt_cos_min = 0.866f;
// What is shaded as one may bend by 20 degrees at an edge, as a column of 18 sides does; whatever else by 8, where
// light is about the same.
constexpr float smooth_bend_cos_min = 0.9396f, bend_cos_min = 0.99f;
constexpr float same_normal_cos = 0.998f;
// Edges meet where their ends are in the same place, to a step.
constexpr float places_per_m = 1024;
// Of the lesser of two charts, what both as one may take more: others fill the corners. (As with planar ones: without
// it nearly flat ground stays in two dozen pieces, 1.8 times as large.)
constexpr float waste_max_of_lesser = 0.3f;
// Other axes than a plane's own, so that light's directions need not be turned at seams, are to save so much.
constexpr float turn_saved_min = 0.05f;
// Joined anew without what was parted. What is still at fault then stays as it was.
constexpr int rounds_max = 32;
// Facets of less than a texel are patches of this size before anything is looked for between them: pairs within the
// filter's reach are too many.
constexpr float patch_texels = 0.5f;

constexpr size_t direction_count = 26;
const std::array<glm::vec3, direction_count>& directions() {
    static const auto all = [] {
        std::array<glm::vec3, direction_count> found;
        size_t n = 0;
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z)
                    if (x || y || z) found[n++] = glm::normalize(glm::vec3(x, y, z));
        return found;
    }();
    return all;
}

// Of many vectors, those that are furthest along some directions: near enough their hull.
class Extremes {
   public:
    explicit Extremes(glm::vec3 first) { vectors_.fill(first); }
    void add(glm::vec3 v) {
        for (size_t i = 0; i < direction_count; ++i)
            if (glm::dot(v - vectors_[i], directions()[i]) > 0) vectors_[i] = v;
    }
    void add(const Extremes& other) {
        for (size_t i = 0; i < direction_count; ++i)
            if (glm::dot(other.vectors_[i] - vectors_[i], directions()[i]) > 0) vectors_[i] = other.vectors_[i];
    }
    auto begin() const { return vectors_.begin(); }
    auto end() const { return vectors_.end(); }

   private:
    std::array<glm::vec3, direction_count> vectors_;
};

// Charts that are one.
struct Patch {
    glm::vec3 normal_area{0};  // sum over faces, m2
    Extremes corners_m, normals;
    glm::vec3 u_axis;
    float texels = 0;           // of the page
    std::set<uint32_t> beside;  // patches across smooth edges
    uint32_t joins = 0;         // of its own: what was found before is of another patch
};

struct Joint {
    float texels;
    glm::vec3 normal, u_axis;
};

enum class Regions { Join, StayApart };  // what a wall cut apart (wall_cuts.cpp)

class Joiner {
   public:
    Joiner(std::span<const PlanarFace> faces, const std::vector<ProjectedChart>& charts, float side_max_texels,
           Regions regions)
        : faces_(faces), charts_(charts), side_max_(side_max_texels), regions_(regions), beside_(charts.size()) {
        findSmoothEdges();
    }

    std::vector<JoinedCharts> join(const ChartPairs& apart) {
        groups_ = Groups(charts_.size());
        for (const auto& [a, b] : apart) groups_.keepApart(a, b);
        patches_.clear();
        patches_.resize(charts_.size());
        for (uint32_t c = 0; c < charts_.size(); ++c)
            if (!beside_[c].empty()) patches_[c] = std::make_unique<Patch>(patchOf(c));
        candidates_ = {};
        for (uint32_t a = 0; a < charts_.size(); ++a)
            for (const uint32_t b : beside_[a])
                if (a < b) consider(a, b);
        while (!candidates_.empty()) {
            const Candidate c = candidates_.top();
            candidates_.pop();
            const auto isAsItWas = [&](uint32_t patch, uint32_t joins) {
                return patches_[patch] && patches_[patch]->joins == joins;
            };
            if (isAsItWas(c.a, c.joins_a) && isAsItWas(c.b, c.joins_b)) joinPair(c.a, c.b);
        }
        std::vector<JoinedCharts> joined(charts_.size(), {{}, Axes({0, 1, 0})});
        for (uint32_t c = 0; c < charts_.size(); ++c) {
            const uint32_t root = groups_.find(c);
            if (const auto& patch = patches_[root])
                joined[root].axes = Axes(glm::normalize(patch->normal_area), patch->u_axis);
            joined[root].charts.push_back(c);
        }
        std::erase_if(joined, [](const JoinedCharts& j) { return j.charts.empty(); });
        return joined;
    }

   private:
    using Place = std::array<int32_t, 3>;  // in steps; levels end at 1000 km

    struct Candidate {
        float cost;
        uint32_t a, b, joins_a, joins_b;
        bool operator<(const Candidate& o) const {
            return std::tie(o.cost, o.a, o.b, o.joins_a, o.joins_b) < std::tie(cost, a, b, joins_a, joins_b);
        }
    };

    void findSmoothEdges() {
        struct Edge {
            Place low, high;
            bool forward;
            uint32_t face, chart;
            glm::vec3 normal_low, normal_high;
        };
        std::vector<Edge> edges;
        for (uint32_t c = 0; c < charts_.size(); ++c)
            for (const uint32_t f : charts_[c].faces)
                for (size_t e = 0; e < 3; ++e) {
                    const size_t to = (e + 1) % 3;
                    Place a = placeOf(faces_[f].corners_m[e]), b = placeOf(faces_[f].corners_m[to]);
                    glm::vec3 at_a = faces_[f].corner_normals[e], at_b = faces_[f].corner_normals[to];
                    if (a == b) continue;
                    const bool forward = a < b;
                    if (!forward) std::swap(a, b), std::swap(at_a, at_b);
                    edges.push_back({a, b, forward, f, c, at_a, at_b});
                }
        std::ranges::sort(edges, {}, [](const Edge& e) { return std::tie(e.low, e.high, e.face, e.forward); });
        // Whatever keeps charts of one plane apart has been seen to there (planar.cpp).
        const auto smooth = [&](const Edge& a, const Edge& b) {
            const float bend_cos = glm::dot(faces_[a.face].normal, faces_[b.face].normal);
            if (inOnePlane(faces_[a.face], faces_[b.face])) return false;
            return bend_cos > bend_cos_min ||
                   (bend_cos > smooth_bend_cos_min && glm::dot(a.normal_low, b.normal_low) > same_normal_cos &&
                    glm::dot(a.normal_high, b.normal_high) > same_normal_cos);
        };
        for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
            while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
                ++end;
            for (size_t i = begin; i < end; ++i)
                for (size_t k = i + 1; k < end; ++k) {
                    const Edge &a = edges[i], &b = edges[k];
                    if (a.forward == b.forward || a.chart == b.chart || !mayMeet(a.chart, b.chart) || !smooth(a, b))
                        continue;
                    beside_[a.chart].insert(b.chart);
                    beside_[b.chart].insert(a.chart);
                }
        }
    }

    static Place placeOf(glm::vec3 p) {
        const auto step = [](float v) { return static_cast<int32_t>(std::lround(v * places_per_m)); };
        return {step(p.x), step(p.y), step(p.z)};
    }

    bool mayMeet(uint32_t a, uint32_t b) const {
        const PlanarFace &face_a = faces_[charts_[a].faces[0]], &face_b = faces_[charts_[b].faces[0]];
        return face_a.group == face_b.group && charts_[a].texels_per_metre == charts_[b].texels_per_metre &&
               (regions_ == Regions::Join || face_a.region == face_b.region);
    }

    Patch patchOf(uint32_t chart) const {
        const ProjectedChart& c = charts_[chart];
        const PlanarFace& first = faces_[c.faces[0]];
        Patch patch{{}, Extremes(first.corners_m[0]), Extremes(first.normal), c.u_axis, 0, beside_[chart], 0};
        for (const uint32_t f : c.faces) {
            const auto& p = faces_[f].corners_m;
            patch.normal_area += 0.5f * glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) * faces_[f].normal;
            patch.normals.add(faces_[f].normal);
            for (const glm::vec3 corner : p) patch.corners_m.add(corner);
        }
        patch.texels = texelsOf(c.size_m, c.texels_per_metre);
        return patch;
    }

    // As unwrap() makes them.
    static float texelsOf(glm::vec2 size_m, float density) {
        const glm::vec2 side =
            glm::max(glm::ceil(size_m * density - 0.01f), glm::vec2(1)) + 2.0f * static_cast<float>(padding_texels);
        return side.x * side.y;
    }

    void consider(uint32_t a, uint32_t b) {
        if (groups_.areApart(a, b)) return;
        const Patch &one = *patches_[a], &other = *patches_[b];
        const auto joint = jointOf(one, other, charts_[a].texels_per_metre);
        if (!joint) return;
        const float apart = one.texels + other.texels;
        if (joint->texels - apart > waste_max_of_lesser * std::min(one.texels, other.texels)) return;
        float tilt_cos = 1;
        for (const Patch* p : {&one, &other})
            for (const glm::vec3 n : p->normals) tilt_cos = std::min(tilt_cos, glm::dot(n, joint->normal));
        candidates_.push({joint->texels / apart * (2 - tilt_cos), a, b, one.joins, other.joins});
    }

    std::optional<Joint> jointOf(const Patch& a, const Patch& b, float density) const {
        const glm::vec3 sum = a.normal_area + b.normal_area;
        if (!(glm::length(sum) > 0)) return std::nullopt;
        const glm::vec3 normal = glm::normalize(sum);
        for (const Patch* p : {&a, &b})
            for (const glm::vec3 n : p->normals)
                if (glm::dot(n, normal) < tilt_cos_min) return std::nullopt;
        std::optional<Joint> best;
        float least = 0;
        for (const Axes& axes : {Axes(normal), Axes(normal, a.u_axis), Axes(normal, b.u_axis)}) {
            Rect rect;
            for (const Patch* p : {&a, &b})
                for (const glm::vec3 corner : p->corners_m) rect.add(axes.on(corner));
            const glm::vec2 size_m = rect.max - rect.min;
            if (std::max(size_m.x, size_m.y) * density > side_max_) continue;
            const float texels = texelsOf(size_m, density);
            if (best && texels > (1 - turn_saved_min) * least) continue;
            best = {texels, normal, axes.u};
            least = texels;
        }
        return best;
    }

    void joinPair(uint32_t a, uint32_t b) {
        const auto joint = jointOf(*patches_[a], *patches_[b], charts_[a].texels_per_metre);
        const auto [whole, part] = groups_.join(a, b);
        const Patch from = std::move(*patches_[part]);
        patches_[part].reset();
        Patch& to = *patches_[whole];
        to.normal_area += from.normal_area;
        to.corners_m.add(from.corners_m);
        to.normals.add(from.normals);
        to.u_axis = joint->u_axis;
        to.texels = joint->texels;
        ++to.joins;
        for (const uint32_t other : from.beside) {
            patches_[other]->beside.erase(part);
            if (other == whole) continue;
            patches_[other]->beside.insert(whole);
            to.beside.insert(other);
        }
        for (const uint32_t other : to.beside) consider(std::min(whole, other), std::max(whole, other));
    }

    std::span<const PlanarFace> faces_;
    const std::vector<ProjectedChart>& charts_;
    float side_max_;
    Regions regions_;
    std::vector<std::set<uint32_t>> beside_;  // per chart: others across smooth edges
    Groups groups_{0};
    std::vector<std::unique_ptr<Patch>> patches_;  // of charts beside others, until they are another one's part
    std::priority_queue<Candidate> candidates_;
};

ProjectedChart chartOf(std::span<const PlanarFace> faces, const std::vector<ProjectedChart>& charts,
                       const JoinedCharts& joined) {
    if (joined.charts.size() == 1) return charts[joined.charts[0]];
    const Axes& axes = joined.axes;
    ProjectedChart chart{axes.u, axes.v, {}, {}, charts[joined.charts[0]].texels_per_metre, {}, true};
    Rect rect;
    for (const uint32_t c : joined.charts)
        for (const uint32_t f : charts[c].faces) {
            rect.add(axes.rectOf(faces[f]));
            chart.faces.push_back(f);
        }
    std::ranges::sort(chart.faces);
    chart.min_m = rect.min, chart.size_m = rect.max - rect.min;
    return chart;
}

// Charts of facets far below a texel, joined to patches that are still smaller than one.
std::vector<ProjectedChart> patchesOf(std::span<const PlanarFace> faces, const std::vector<ProjectedChart>& charts) {
    std::vector<ProjectedChart> patches;
    for (const JoinedCharts& j : Joiner(faces, charts, patch_texels, Regions::StayApart).join({}))
        patches.push_back(chartOf(faces, charts, j));
    return patches;
}

}  // namespace

std::vector<ProjectedChart> joinCurved(std::span<const PlanarFace> faces, const std::vector<ProjectedChart>& planar,
                                       uint32_t side_max_texels, const Standing& standing) {
    const std::vector<ProjectedChart> charts = patchesOf(faces, planar);
    Joiner joiner(faces, charts, static_cast<float>(side_max_texels), Regions::Join);
    ChartFaults faults(faces, charts, standing);
    ChartPairs apart, last;
    std::vector<JoinedCharts> joined;
    for (int round = 0; round < rounds_max && (round == 0 || !last.empty()); ++round) {
        joined = joiner.join(apart);
        last = faults.in(joined);
        apart.insert(last.begin(), last.end());
    }
    std::vector<ProjectedChart> out;
    for (const JoinedCharts& j : joined) {
        const auto isPart = [&](const auto& pair) { return std::ranges::binary_search(j.charts, pair.first); };
        if (std::ranges::none_of(last, isPart))
            out.push_back(chartOf(faces, charts, j));
        else
            for (const uint32_t c : j.charts) out.push_back(charts[c]);
    }
    std::ranges::sort(out, {}, [](const ProjectedChart& c) { return c.faces[0]; });
    return out;
}

}  // namespace dimmer::cook
