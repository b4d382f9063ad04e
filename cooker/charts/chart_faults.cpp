#include <charts/chart_faults.h>

#include <charts/raster.h>
#include <charts/unwrap.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace dimmer::cook {
namespace {

// Over a surface that tilts by 30 degrees the way is 1.15 times that along the plane; more is the way to another one.
constexpr float detour_max = 1.5f;
// Between the middles of two faces that a wall cut it stands at least as high.
constexpr float cut_wall_m = 0.3f;
constexpr float about_one_plane_cos = 0.998f;
// Slopes of up to 60 degrees are ground; what is steeper than 37 on them may be a wall.
constexpr float ground_cos_min = 0.5f, flat_cos = 0.8f;

// The normal of the plane that walls stand on: plumb where it is ground, or a ceiling, however that slopes.
glm::vec3 standsOn(glm::vec3 normal) {
    if (std::abs(normal.y) < ground_cos_min) return normal;
    return {0, std::copysign(1.0f, normal.y), 0};
}

// Whether a point of `a` is over another one of `b`, or seems to be closer to it than it is.
bool seemsCloser(const PlanarFace& a, const PlanarFace& b, const Axes& axes, float reach_m) {
    const glm::vec3 normal = glm::cross(axes.u, axes.v);
    std::array<glm::vec2, 3> flat;
    PlanarFace flat_b = b;
    for (size_t i = 0; i < 3; ++i) {
        flat[i] = axes.on(b.corners_m[i]);
        flat_b.corners_m[i] = glm::vec3(flat[i], 0);
    }
    for (size_t e = 0; e < 3; ++e)
        for (const float s : {0.0f, 0.5f}) {
            const glm::vec3 p = glm::mix(a.corners_m[e], a.corners_m[(e + 1) % 3], s), flat_p(axes.on(p), 0);
            if (barycentric(flat, glm::vec2(flat_p))) {
                const float over_m = glm::dot(b.normal, p - b.corners_m[0]) / glm::dot(b.normal, normal);
                if (std::abs(over_m) > hiding_m) return true;
                continue;
            }
            const float seems_m = glm::length(flat_p - nearestOnEdges(flat_b, flat_p));
            if (seems_m < reach_m && glm::length(p - nearestOnEdges(b, p)) > detour_max * seems_m + hiding_m)
                return true;
        }
    return false;
}

}  // namespace

ChartFaults::ChartFaults(std::span<const PlanarFace> faces, const std::vector<ProjectedChart>& charts,
                         const Standing& standing)
    : faces_(faces), charts_(charts), standing_(standing), looked_at_(charts.size(), no_index) {}

ChartPairs ChartFaults::in(std::span<const JoinedCharts> joined) {
    std::vector<Found> found(joined.size());
    tbb::parallel_for(size_t{0}, joined.size(), [&](size_t i) { found[i] = in(joined[i]); });
    ChartPairs all;
    for (uint32_t i = 0; i < joined.size(); ++i) {
        all.insert(found[i].begin(), found[i].end());
        for (const uint32_t c : joined[i].charts) looked_at_[c] = i;
    }
    return all;
}

// Of one that is much smaller than a texel the face in its middle stands for all.
std::vector<uint32_t> ChartFaults::facesOf(const ProjectedChart& chart) const {
    if (!chart.curved) return chart.faces;
    const auto off_m = [&](uint32_t face) {
        const glm::vec3 p = middleOf(faces_[face]);
        return glm::length(glm::vec2(glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis)) - chart.min_m -
                           0.5f * chart.size_m);
    };
    return {*std::ranges::min_element(chart.faces, {}, off_m)};
}

std::vector<ChartFaults::Part> ChartFaults::partsOf(const JoinedCharts& joined) const {
    const glm::vec3 normal = glm::cross(joined.axes.u, joined.axes.v);
    std::vector<Part> parts;
    for (const uint32_t c : joined.charts)
        for (const uint32_t f : facesOf(charts_[c])) {
            Part part{c, f, joined.axes.rectOf(faces_[f]), 1e30f, -1e30f};
            for (const glm::vec3 p : faces_[f].corners_m) {
                const float height_m = glm::dot(normal, p);
                part.low_m = std::min(part.low_m, height_m), part.high_m = std::max(part.high_m, height_m);
            }
            parts.push_back(part);
        }
    return parts;
}

ChartFaults::Found ChartFaults::in(const JoinedCharts& joined) const {
    if (joined.charts.size() < 2) return {};
    const float reach_m = filter_reach_texels / charts_[joined.charts[0]].texels_per_metre;
    const std::vector<Part> parts = partsOf(joined);
    std::vector<BoxTree::Box> boxes;
    for (const Part& p : parts) boxes.push_back({{p.rect.min - reach_m, 0}, {p.rect.max, 0}});
    const BoxTree tree(boxes);
    std::vector<Found> found(parts.size());
    tbb::parallel_for(size_t{0}, parts.size(), [&](size_t i) {
        const PlanarFace& face = faces_[parts[i].face];
        const auto note = [&](uint32_t other) { found[i].push_back(std::minmax(parts[i].chart, other)); };
        std::vector<Part> others;
        for (const uint32_t k : tree.touching(boxes[i])) {
            if (k <= i || parts[k].chart == parts[i].chart) continue;
            if (stacked(parts[i], parts[k], joined.axes, reach_m))
                note(parts[k].chart);
            else if (standing_.blocked && !wasLookedAt(parts[i].chart, parts[k].chart))
                others.push_back(parts[k]);
        }
        if (others.empty()) return;
        const FaceWalls walls = wallsOf(face, others, reach_m);
        for (const Part& other : others)
            if ((!walls.none() && walls.part(faces_[other.face])) || besideWall(face, faces_[other.face]))
                note(other.chart);
    });
    Found all;
    for (const Found& pairs : found) all.insert(all.end(), pairs.begin(), pairs.end());
    return all;
}

FaceWalls ChartFaults::wallsOf(const PlanarFace& face, std::span<const Part> others, float near_m) const {
    const Axes axes(standsOn(face.normal));
    const glm::vec3 normal = glm::cross(axes.u, axes.v);
    FaceWalls::Reach reach{near_m, 0, 0, 0, flat_cos};
    const auto add = [&](const PlanarFace& f) {
        for (const glm::vec3 p : f.corners_m) {
            const glm::vec3 from = p - face.corners_m[0];
            const float height_m = glm::dot(normal, from);
            reach.lowest_m = std::min(reach.lowest_m, height_m);
            reach.highest_m = std::max(reach.highest_m, height_m);
            reach.largest_m = std::max(reach.largest_m, glm::length(from));
        }
    };
    add(face);
    for (const Part& other : others) add(faces_[other.face]);
    return {face, axes, reach, standing_};
}

bool ChartFaults::wasLookedAt(uint32_t a, uint32_t b) const {
    return looked_at_[a] != no_index && looked_at_[a] == looked_at_[b];
}

// Whether they are of two sides of what a wall cut (wall_cuts.cpp), half of the wall with them.
bool ChartFaults::besideWall(const PlanarFace& a, const PlanarFace& b) const {
    if (a.region == b.region || a.region == 0 || b.region == 0) return false;
    if (glm::dot(a.normal, b.normal) > about_one_plane_cos) return true;
    const glm::vec3 lift = a.normal * cut_wall_m, from = middleOf(a) + lift, to = middleOf(b) + lift;
    return standing_.blocked(from, to) || standing_.blocked(to, from);
}

bool ChartFaults::stacked(const Part& a, const Part& b, const Axes& axes, float reach_m) const {
    // By far the most: further apart along the plane than up and down.
    const glm::vec2 gap_m = glm::max(glm::max(a.rect.min - b.rect.max, b.rect.min - a.rect.max), glm::vec2(0));
    if (glm::length(gap_m) > std::max(a.high_m - b.low_m, b.high_m - a.low_m)) return false;
    const PlanarFace &face = faces_[a.face], &other = faces_[b.face];
    return seemsCloser(face, other, axes, reach_m) || seemsCloser(other, face, axes, reach_m);
}

}  // namespace dimmer::cook
