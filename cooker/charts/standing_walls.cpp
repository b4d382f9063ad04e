#include <charts/standing_walls.h>

#include <charts/polygon.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>
#include <utility>

namespace dimmer::cook {
namespace {

constexpr float reach_texels = 2.5f;   // thinner than this leaks: bilinear filtering plus half a texel of averaging
constexpr float doorway_min_m = 0.5f;  // narrower ones are gaps between a shelf's boards
constexpr float facing_cos = 0.99f, facing_share = 0.9f, probe_share_of_room = 0.9f;
constexpr float lean_max = 1.75f;      // what leans more is a roof
constexpr float slope_cos_min = 0.5f;  // and what slopes more no ground
// A trace need not be quite straight along the axis, over so much of its length and of a texel.
constexpr float skew_share = 0.02f, skew_texels = 0.25f;
// Directions of what stands on one chart are looked for so far: those of a tower of 256 sides.
constexpr size_t turns_max = 64;
constexpr float facet_min_texels = 0.25f;  // shorter ones have no direction of their own
constexpr float skins_per_m = 1;           // places at which is looked what is behind a skin, within limits
constexpr int skins_min = 3, skins_max = 16;
constexpr float thick_m = 1;         // of solids: farther behind a face, a back is another wall's
constexpr float room_min_m = 0.25f;  // between skins: less is no room

// Pieces of one wall (its triangles, its faces) become one line.
std::vector<WallLine> joined(std::vector<WallLine> lines) {
    std::ranges::sort(lines, {}, [](const WallLine& l) { return std::tuple(l.axis, l.at, l.from, l.to); });
    std::vector<WallLine> joined;
    size_t first = 0;  // of those that are on the line of the ones to come
    for (const WallLine& l : lines) {
        while (first < joined.size() && (joined[first].axis != l.axis || !(l.at - joined[first].at < same_line_m)))
            ++first;
        const auto same = std::find_if(
            joined.begin() + static_cast<std::ptrdiff_t>(first), joined.end(),
            [&](const WallLine& o) { return l.from <= o.to + same_line_m && o.from <= l.to + same_line_m; });
        if (same == joined.end()) {
            joined.push_back(l);
            continue;
        }
        same->from = std::min(same->from, l.from);
        same->to = std::max(same->to, l.to);
    }
    return joined;
}

glm::vec2 flat(const ProjectedChart& chart, glm::vec3 p) {
    return {glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis)};
}

}  // namespace

StandingWalls::StandingWalls(std::span<const PlanarFace> faces, Blocking blocking)
    : faces_(faces), blocking_(faces, std::move(blocking)) {
    std::vector<BoxTree::Box> boxes;
    for (const PlanarFace& face : faces_) boxes.push_back(BoxTree::boxOf(face.corners_m));
    boxes_ = BoxTree(std::move(boxes));
}

WallLines StandingWalls::on(const ProjectedChart& chart, float coarsest_texels_per_metre) const {
    const float reach_m = reach_texels / coarsest_texels_per_metre;
    WallLines found{turnsOf(chart), {}};
    for (uint32_t t = 0; t < found.turns.size(); ++t)
        for (WallLine& line : alongAxes(t == 0 ? chart : turned(chart, found.turns[t]), reach_m)) {
            line.turn = t;
            found.lines.push_back(line);
        }
    return found;
}

// Its own axes, and those along which something stands on it otherwise, the longest first.
std::vector<Turn> StandingWalls::turnsOf(const ProjectedChart& chart) const {
    std::vector<Segment> segments = segmentsAt(chart, wall_probe_low_m, Which::All);
    const std::vector<Segment> leaves = segmentsAt(chart, leaf_probe_low_m, Which::Leaves);
    segments.insert(segments.end(), leaves.begin(), leaves.end());
    std::erase_if(segments, [&](const Segment& s) {
        return !(std::abs(s.rise) < lean_max * glm::length(s.normal)) ||
               glm::length(s.b - s.a) * chart.texels_per_metre < facet_min_texels;
    });
    std::ranges::stable_sort(segments, std::greater(), [](const Segment& s) { return glm::length(s.b - s.a); });
    std::vector<Turn> turns{{}};
    for (const Segment& s : segments) {
        const auto fits = [&](const Turn& turn) {
            const glm::vec2 off = glm::abs(turn.on(s.b - s.a));
            return std::min(off.x, off.y) <= s.slackM(chart.texels_per_metre);
        };
        if (std::ranges::any_of(turns, fits)) continue;
        glm::vec2 d = glm::normalize(s.b - s.a);
        while (!(d.x > 0 && d.y >= 0)) d = {-d.y, d.x};
        turns.push_back({d.x, d.y});
        if (turns.size() == turns_max) break;
    }
    return turns;
}

ProjectedChart StandingWalls::turned(const ProjectedChart& chart, Turn turn) const {
    ProjectedChart other = chart;
    other.u_axis = turn.cos * chart.u_axis + turn.sin * chart.v_axis;
    other.v_axis = turn.cos * chart.v_axis - turn.sin * chart.u_axis;
    glm::vec2 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    for (const uint32_t face : chart.faces)
        for (const glm::vec3 p : faces_[face].corners_m) {
            low = glm::min(low, flat(other, p));
            high = glm::max(high, flat(other, p));
        }
    other.min_m = low, other.size_m = high - low;
    return other;
}

std::vector<WallLine> StandingWalls::alongAxes(const ProjectedChart& chart, float reach_m) const {
    std::vector<Trace> low = lowTraces(chart), high = joinedTraces(findTraces(chart, highProbe(chart), Which::All));
    sortByPlace(low);
    sortByPlace(high);
    const std::vector<Trace> traces = standing(low, high);
    std::vector<WallLine> lines;
    for (const Trace& trace : traces)
        if (isSkin(chart, trace)) lines.push_back(trace);
    std::vector<Solid> solids = solidsOf(traces, reach_m);
    const std::vector<Solid> feet = solidsBelow(solidsOf(high, reach_m), solidsOf(low, reach_m), reach_m);
    solids.insert(solids.end(), feet.begin(), feet.end());
    for (const Solid& s : solids) lines.push_back({s.axis, 0.5f * (s.low + s.high), s.from, s.to});
    return joined(std::move(lines));
}

// A wall is as high as there is room: between the jambs of a narrow doorway a closed leaf stands from one to the
// other, and is no higher over either. So below what faces nearly all of the chart, where that is near.
float StandingWalls::highProbe(const ProjectedChart& chart) const {
    const PlanarFace& any = faces_[chart.faces[0]];
    if (any.group != 0) return wall_probe_high_m;  // of a door's leaf
    const float plane = glm::dot(any.normal, any.corners_m[0]);
    const glm::vec2 low = chart.min_m, high = chart.min_m + chart.size_m;
    BoxTree::Box box = boxOver(chart, 0);
    const BoxTree::Box above = boxOver(chart, wall_probe_high_m);
    box.min_m = glm::min(box.min_m, above.min_m), box.max_m = glm::max(box.max_m, above.max_m);
    std::vector<std::pair<float, float>> facing;  // height, area over the chart's rectangle
    for (const uint32_t near : blocking_.touching(box)) {
        const PlanarFace& face = blocking_.face(near);
        const float height = glm::dot(any.normal, face.corners_m[0]) - plane;
        const bool moves = face.group != 0;
        if (moves || glm::dot(any.normal, face.normal) > -facing_cos || height < doorway_min_m ||
            height > wall_probe_high_m)
            continue;
        Polygon over;
        for (const glm::vec3 p : face.corners_m) over.push_back(flat(chart, p));
        for (int axis = 0; axis < 2; ++axis) {
            const glm::vec2 normal = Turn{}.axis(axis);
            over = clipped(clipped(over, normal, low[axis], 1), normal, high[axis], -1);
        }
        facing.emplace_back(height, polygonArea(over));
    }
    std::ranges::sort(facing);
    float covered = 0;
    for (const auto& [height, area_m2] : facing)
        if ((covered += area_m2) >= facing_share * chart.size_m.x * chart.size_m.y) return probe_share_of_room * height;
    return wall_probe_high_m;
}

// A place at a height over a chart. The normal of one of its faces may differ from the chart's own by a rounding step.
glm::vec3 StandingWalls::onPlane(const ProjectedChart& chart, glm::vec2 at, float height_m) const {
    const PlanarFace& any = faces_[chart.faces[0]];
    const float height = glm::dot(any.normal, any.corners_m[0]) + height_m;
    const glm::vec3 up = glm::cross(chart.u_axis, chart.v_axis);
    const glm::vec3 p = at.x * chart.u_axis + at.y * chart.v_axis;
    return p + up * ((height - glm::dot(any.normal, p)) / glm::dot(any.normal, up));
}

// What holds every trace that counts at a height over a chart's rectangle, over slopes plumb as well: what stands
// there is on no small facet's rectangle any more.
BoxTree::Box StandingWalls::boxOver(const ProjectedChart& chart, float height_m) const {
    const glm::vec3 normal = faces_[chart.faces[0]].normal;
    const bool slopes = std::abs(normal.y) > slope_cos_min;
    const glm::vec3 plumb = slopes ? glm::vec3(0, height_m / normal.y, 0) - height_m * normal : glm::vec3(0);
    std::array<glm::vec3, 8> corners;
    for (uint32_t i = 0; i < 4; ++i) {
        corners[i] = onPlane(chart, chart.min_m + chart.size_m * glm::vec2(i & 1, i >> 1), height_m);
        corners[i + 4] = corners[i] + plumb;
    }
    BoxTree::Box box = BoxTree::boxOf(corners);
    const float reach_m =
        wall_margin_m + same_line_m +
        rounding_share * std::max({blocking_.largestCoordinate(), largestOf(box.min_m), largestOf(box.max_m)});
    box.min_m -= reach_m;
    box.max_m += reach_m;
    return box;
}

float StandingWalls::Segment::slackM(float texels_per_metre) const {
    return std::max(same_line_m,
                    std::min({skew_share * glm::length(b - a), skew_texels / texels_per_metre, skew_max_m}));
}

std::vector<StandingWalls::Segment> StandingWalls::segmentsAt(const ProjectedChart& chart, float height_m,
                                                              Which which) const {
    const PlanarFace& any = faces_[chart.faces[0]];
    const float height = glm::dot(any.normal, any.corners_m[0]) + height_m;
    std::vector<Segment> segments;
    for (const uint32_t near : blocking_.touching(boxOver(chart, height_m))) {
        const PlanarFace& face = blocking_.face(near);
        if (which != Which::All && (face.group != 0) != (which == Which::Leaves)) continue;
        std::array<float, 3> d;
        for (size_t i = 0; i < 3; ++i) d[i] = glm::dot(any.normal, face.corners_m[i]) - height;
        std::array<glm::vec2, 2> ends;
        size_t n = 0;
        for (size_t i = 0; i < 3 && n < 2; ++i) {
            const size_t j = (i + 1) % 3;
            if ((d[i] > 0) == (d[j] > 0)) continue;
            ends[n++] = flat(chart, glm::mix(face.corners_m[i], face.corners_m[j], d[i] / (d[i] - d[j])));
        }
        if (n < 2) continue;
        segments.push_back({ends[0], ends[1], flat(chart, face.normal), glm::dot(any.normal, face.normal),
                            blocking_.isDoubleSided(near)});
    }
    return segments;
}

std::vector<Trace> StandingWalls::findTraces(const ProjectedChart& chart, float height_m, Which which) const {
    const glm::vec2 low = chart.min_m, high = chart.min_m + chart.size_m;
    std::vector<Trace> traces;
    for (const Segment& segment : segmentsAt(chart, height_m, which)) {
        const auto& [a, b, normal, rise, double_sided] = segment;
        for (int axis = 0; axis < 2; ++axis) {
            const int along = 1 - axis;
            if (std::abs(a[axis] - b[axis]) > segment.slackM(chart.texels_per_metre)) continue;
            const float lean = -rise / normal[axis];
            if (!(std::abs(lean) < lean_max)) continue;
            const float at = 0.5f * (a[axis] + b[axis]), from = std::max(low[along], std::min(a[along], b[along])),
                        to = std::min(high[along], std::max(a[along], b[along])), foot = at - lean * height_m;
            if (to - from < same_line_m || foot < low[axis] - wall_margin_m || foot > high[axis] + wall_margin_m)
                continue;
            const bool forward = normal[axis] > 0;
            Trace trace{{axis, at, from, to}, forward, double_sided, lean};
            const bool long_enough = std::abs(a[along] - b[along]) > same_line_m;
            trace.skew = long_enough ? (b[axis] - a[axis]) / (b[along] - a[along]) : 0;
            trace.middle = 0.5f * (a[along] + b[along]);
            trace.height_m = height_m;
            traces.push_back(trace);
            trace.forward = !forward;
            if (double_sided) traces.push_back(trace);
        }
    }
    return traces;
}

// Of leaves over what does not move a little higher up.
std::vector<Trace> StandingWalls::lowTraces(const ProjectedChart& chart) const {
    if (faces_[chart.faces[0]].group != 0) return joinedTraces(findTraces(chart, wall_probe_low_m, Which::All));
    std::vector<Trace> traces = findTraces(chart, wall_probe_low_m, Which::Fixed);
    const std::vector<Trace> leaves = findTraces(chart, leaf_probe_low_m, Which::Leaves);
    traces.insert(traces.end(), leaves.begin(), leaves.end());
    return joinedTraces(std::move(traces));
}

// A face of no solid: the chart goes on behind it, with room, and backs are seen there neither close behind, nor along
// the face or straight up. (They are within solids, and within what lacks the sides that touch others: cupboards,
// steps.)
bool StandingWalls::isSkin(const ProjectedChart& chart, const Trace& trace) const {
    if (trace.double_sided) return false;
    const glm::vec3 up = glm::cross(chart.u_axis, chart.v_axis), along = trace.axis == 0 ? chart.v_axis : chart.u_axis,
                    behind = (trace.forward ? -1.0f : 1.0f) * (trace.axis == 0 ? chart.u_axis : chart.v_axis);
    const int places = std::clamp(static_cast<int>(skins_per_m * (trace.to - trace.from)), skins_min, skins_max);
    for (int i = 0; i < places; ++i) {
        // Off the middle, where edges are.
        const float at = glm::mix(trace.from, trace.to, (static_cast<float>(i) + 0.57f) / static_cast<float>(places));
        const glm::vec3 on_line =
            onPlane(chart, trace.axis == 0 ? glm::vec2(trace.at, at) : glm::vec2(at, trace.at), 0);
        const glm::vec3 beside = 2 * wall_margin_m * behind;
        if (!covers(chart, on_line - beside) || !covers(chart, on_line + beside)) continue;
        const glm::vec3 from = on_line + beside + wall_probe_low_m * up;
        const BlockingRays::Met next = blocking_.meets(from, behind);
        const bool open = next.at_m > (next.is_back ? thick_m : room_min_m);
        if (open && !blocking_.meets(from, along).is_back && !blocking_.meets(from, -along).is_back &&
            !blocking_.meets(from, up).is_back)
            return true;
    }
    return false;
}

bool StandingWalls::covers(const ProjectedChart& chart, glm::vec3 p) const {
    const glm::vec2 at = flat(chart, p);
    return std::ranges::any_of(boxes_.touching({p - same_line_m, p + same_line_m}), [&](uint32_t face) {
        if (!std::ranges::binary_search(chart.faces, face)) return false;
        std::array<float, 3> side;
        for (size_t i = 0; i < 3; ++i) {
            const glm::vec2 a = flat(chart, faces_[face].corners_m[i]),
                            b = flat(chart, faces_[face].corners_m[(i + 1) % 3]);
            side[i] = (b.x - a.x) * (at.y - a.y) - (b.y - a.y) * (at.x - a.x);
        }
        return std::ranges::min(side) >= 0;
    });
}

}  // namespace dimmer::cook
