#include <charts/wall_traces.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace dimmer::cook {
namespace {

constexpr float same_slope = 1e-3f;  // of pieces that become one trace: less askew and leaning apart is rounding
// Feet of walls, and how far their pieces may lie apart, along them and, of their thickness, across.
constexpr float foot_min_m = 0.25f, foot_length_min = 2, foot_gap_m = 0.02f, same_foot = 0.25f;

auto placeOf(const Trace& trace) {
    return std::tuple(trace.axis, trace.forward, trace.at);
}

// Pieces of one foot together, as a rough wall has many; legs of chairs and the like are left out.
std::vector<Solid> longOnes(std::vector<Solid> solids) {
    std::ranges::sort(solids, {}, [](const Solid& s) { return std::tuple(s.axis, s.from, s.to, s.low, s.high); });
    std::vector<Solid> joined;
    for (const Solid& s : solids) {
        const auto goesOn = [&](const Solid& other) {
            const float apart_m = 0.5f * std::abs(s.low + s.high - other.low - other.high);
            return other.axis == s.axis && s.from <= other.to + foot_gap_m &&
                   apart_m <= std::max(same_line_m, same_foot * std::min(s.high - s.low, other.high - other.low));
        };
        const auto other = std::ranges::find_if(joined, goesOn);
        if (other == joined.end())
            joined.push_back(s);
        else
            other->to = std::max(other->to, s.to);
    }
    std::erase_if(joined, [](const Solid& s) {
        return s.to - s.from < std::max(foot_min_m, foot_length_min * (s.high - s.low));
    });
    return joined;
}

// What is left of stretches without one more, but for what is too short to count.
std::vector<glm::vec2> without(std::span<const glm::vec2> stretches, glm::vec2 gone) {
    std::vector<glm::vec2> left;
    for (const glm::vec2 stretch : stretches) {
        const float from = std::max(stretch.x, gone.x), to = std::min(stretch.y, gone.y);
        if (!(to - from > same_line_m)) {
            left.push_back(stretch);
            continue;
        }
        left.push_back({stretch.x, from});
        left.push_back({to, stretch.y});
    }
    std::erase_if(left, [](glm::vec2 stretch) { return !(stretch.y - stretch.x > same_line_m); });
    return left;
}

}  // namespace

float slackAt(float at) {
    return 4 * std::numeric_limits<float>::epsilon() * std::abs(at);
}

void sortByPlace(std::vector<Trace>& traces) {
    std::ranges::sort(traces, {}, placeOf);
}

std::span<const Trace> tracesNear(std::span<const Trace> sorted, int axis, bool forward, float low, float high) {
    const auto first = std::ranges::lower_bound(sorted, std::tuple(axis, forward, low - slackAt(low)), {}, placeOf);
    return {first, std::ranges::upper_bound(first, sorted.end(), std::tuple(axis, forward, high + slackAt(high)), {},
                                            placeOf)};
}

std::vector<Trace> joinedTraces(std::vector<Trace> traces) {
    const auto kind = [](const Trace& t) { return std::tuple(t.axis, t.forward, t.double_sided, t.height_m); };
    std::ranges::sort(traces, {}, [&](const Trace& t) { return std::tuple(kind(t), t.at, t.from, t.to, t.lean); });
    std::vector<Trace> joined;
    for (const Trace& t : traces) {
        if (!joined.empty()) {
            Trace& last = joined.back();
            const bool straight = std::abs(last.skew) < same_slope && std::abs(t.skew) < same_slope;
            if (kind(last) == kind(t) && last.at == t.at && t.from <= last.to + same_line_m && straight &&
                std::abs(last.lean - t.lean) < same_slope) {
                last.to = std::max(last.to, t.to);
                continue;
            }
        }
        joined.push_back(t);
    }
    return joined;
}

std::vector<Trace> standing(const std::vector<Trace>& low, const std::vector<Trace>& high) {
    std::vector<Trace> both;
    for (const Trace& a : low) {
        const float leans_m = high.empty() ? 0 : a.lean * (high[0].height_m - a.height_m);
        const float at = a.at + leans_m, reach_m = same_line_m + skew_max_m;
        for (const Trace& b : tracesNear(high, a.axis, a.forward, at - reach_m, at + reach_m)) {
            Trace trace = a;
            trace.from = std::max(a.from, b.from), trace.to = std::min(a.to, b.to);
            if (!(trace.to - trace.from > same_line_m)) continue;
            const float middle = 0.5f * (trace.from + trace.to);
            if (std::abs(a.atAlong(middle) + leans_m - b.atAlong(middle)) <= same_line_m) both.push_back(trace);
        }
    }
    sortByPlace(both);
    return both;
}

std::vector<Solid> solidsOf(std::span<const Trace> sorted, float reach_m) {
    std::vector<Solid> solids;
    for (const Trace& a : sorted) {
        if (a.forward) continue;
        std::vector<glm::vec2> open{{a.from, a.to}};
        for (const Trace& b : tracesNear(sorted, a.axis, true, a.at - same_line_m, a.at + reach_m)) {
            if (b.at < a.at - same_line_m || b.at - a.at > reach_m) continue;
            for (const glm::vec2 stretch : open) {
                const float from = std::max(stretch.x, b.from), to = std::min(stretch.y, b.to);
                if (to - from > same_line_m) solids.push_back({a.axis, a.at, b.at, from, to});
            }
            open = without(open, {b.from, b.to});
            if (open.empty()) break;
        }
    }
    return solids;
}

std::vector<Solid> solidsBelow(std::span<const Solid> high, std::span<const Solid> low, float reach_m) {
    const auto placeOfSolid = [](const Solid& s) { return std::pair(s.axis, s.low); };
    std::vector<Solid> sorted(high.begin(), high.end()), below;
    std::ranges::sort(sorted, {}, placeOfSolid);
    for (const Solid& a : low) {
        const auto first = std::ranges::lower_bound(sorted, std::pair(a.axis, a.low - reach_m), {}, placeOfSolid);
        for (auto b = first; b != sorted.end() && b->axis == a.axis && b->low <= a.high + same_line_m; ++b) {
            const float from = std::max(a.from, b->from), to = std::min(a.to, b->to);
            if (b->high >= a.low - same_line_m && to - from > same_line_m)
                below.push_back({a.axis, a.low, a.high, from, to});
        }
    }
    return longOnes(std::move(below));
}

}  // namespace dimmer::cook
