// Convex polygons in a chart's plane.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

using Polygon = std::vector<glm::vec2>;

inline float polygonArea(const Polygon& p) {
    float twice = 0;
    for (size_t i = 2; i < p.size(); ++i) {
        const glm::vec2 a = p[i - 1] - p[0], b = p[i] - p[0];
        twice += a.x * b.y - a.y * b.x;
    }
    return 0.5f * std::abs(twice);
}

// The part on one side of the line x = at (axis 0) or y = at (axis 1): beyond it (sign 1) or before it (-1).
inline Polygon clipped(const Polygon& polygon, int axis, float at, float sign) {
    Polygon out;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const glm::vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
        const float da = sign * (a[axis] - at), db = sign * (b[axis] - at);
        if (da >= 0) out.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            glm::vec2 p = a + (b - a) * (da / (da - db));
            p[axis] = at;
            out.push_back(p);
        }
    }
    return out;
}

}  // namespace dimmer::cook
