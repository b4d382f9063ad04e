// The outlines of what stands on a chart, and what is solid between them.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

inline constexpr float same_line_m = 2e-3f;     // what lies closer is one line
inline constexpr float rounding_share = 1e-5f;  // of the largest coordinate: far above what a few dot products lose
inline constexpr float skew_max_m = 0.1f;       // of what is not quite straight along an axis

// Where a wall stands on a chart: a stretch of the line x = at (axis 0) or y = at (axis 1), in metres along axes that
// may be turned.
struct WallLine {
    int axis = 0;
    float at = 0, from = 0, to = 0;
    uint32_t turn = 0;  // whose axes
};

// What sums with a coordinate lose to rounding, and more.
float slackAt(float at);

// The trace of blocking triangles in one plane at a height over a chart.
struct Trace : WallLine {
    bool forward = false;       // its front looks towards larger coordinates
    bool double_sided = false;  // of triangles that leave a trace of either direction
    float lean = 0;             // metres that it moves along its axis with each metre of height
    float skew = 0;             // and along the other axis, from its own middle on
    float middle = 0;
    float height_m = 0;

    float atAlong(float place) const { return at + skew * (place - middle); }
};

// Between a face that looks back and the next that looks forward, at a height over a chart.
struct Solid {
    int axis = 0;
    float low = 0, high = 0, from = 0, to = 0;  // across the axis' line, and along it
};

// In the order that the functions below want them in.
void sortByPlace(std::vector<Trace>& traces);
// Those between two places, and perhaps a few more.
std::span<const Trace> tracesNear(std::span<const Trace> sorted, int axis, bool forward, float low, float high);
// A tessellated wall is one: of its pieces on one line.
std::vector<Trace> joinedTraces(std::vector<Trace> traces);
// What is there at both heights, in one plane; sorted.
std::vector<Trace> standing(const std::vector<Trace>& low, const std::vector<Trace>& high);
// At most so thick; stretch by stretch.
std::vector<Solid> solidsOf(std::span<const Trace> sorted, float reach_m);
// What of the low ones has a high one above it: the foot of a wall, which a skirting makes thicker, or a moulding.
std::vector<Solid> solidsBelow(std::span<const Solid> high, std::span<const Solid> low, float reach_m);

}  // namespace dimmer::cook
