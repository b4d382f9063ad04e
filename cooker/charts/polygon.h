// Convex polygons and rectangles in a chart's plane.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

struct Rect {
    glm::vec2 min{1e30f}, max{-1e30f};
    void add(glm::vec2 p) {
        min = glm::min(min, p);
        max = glm::max(max, p);
    }
    void add(const Rect& r) {
        add(r.min);
        add(r.max);
    }
    float area() const { return (max.x - min.x) * (max.y - min.y); }
    bool touches(const Rect& r) const {
        return glm::all(glm::lessThanEqual(min, r.max)) && glm::all(glm::lessThanEqual(r.min, max));
    }
};

using Polygon = std::vector<glm::vec2>;

// Above 0 where the corners go round counter-clockwise.
inline float signedArea(const Polygon& p) {
    float twice = 0;
    for (size_t i = 2; i < p.size(); ++i) {
        const glm::vec2 a = p[i - 1] - p[0], b = p[i] - p[0];
        twice += a.x * b.y - a.y * b.x;
    }
    return 0.5f * twice;
}

inline float polygonArea(const Polygon& p) {
    return std::abs(signedArea(p));
}

// Of the same area and outline, were it long: 0 for what rounding leaves of a cut along an edge.
inline float polygonWidth(const Polygon& p) {
    float around = 0;
    for (size_t i = 0; i < p.size(); ++i) around += glm::length(p[(i + 1) % p.size()] - p[i]);
    return around > 0 ? 2 * polygonArea(p) / around : 0;
}

// The part on one side of the line of points p with normal . p = at: beyond it (sign 1) or before it (-1). `normal` is
// a unit vector.
inline Polygon clipped(const Polygon& polygon, glm::vec2 normal, float at, float sign) {
    Polygon out;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const glm::vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
        const float da = sign * (glm::dot(a, normal) - at), db = sign * (glm::dot(b, normal) - at);
        if (da >= 0) out.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            const glm::vec2 p = a + (b - a) * (da / (da - db));
            out.push_back(p + normal * (at - glm::dot(p, normal)));
        }
    }
    return out;
}

}  // namespace dimmer::cook
