// Triangles on a grid of unit squares.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <utility>
#include <vector>

namespace dimmer::cook {

inline float cross2d(glm::vec2 a, glm::vec2 b) {
    return a.x * b.y - a.y * b.x;
}

// Barycentric weights of the second and third corner, or nothing when `p` lies outside.
inline std::optional<glm::vec2> barycentric(const std::array<glm::vec2, 3>& t, glm::vec2 p) {
    const float area = cross2d(t[1] - t[0], t[2] - t[0]);
    const float u = cross2d(p - t[0], t[2] - t[0]) / area, v = cross2d(t[1] - t[0], p - t[0]) / area;
    if (!(u >= 0 && v >= 0 && u + v <= 1)) return std::nullopt;
    return glm::vec2(u, v);
}

struct CellRange {
    uint32_t x0, y0, x1, y1;  // first and one past the last
};

inline CellRange cellRange(const std::array<glm::vec2, 3>& t, glm::uvec2 size) {
    const glm::vec2 low = glm::min(t[0], glm::min(t[1], t[2])), high = glm::max(t[0], glm::max(t[1], t[2]));
    auto cell = [](float v, uint32_t limit) {
        return static_cast<uint32_t>(std::clamp(std::floor(v), 0.0f, static_cast<float>(limit)));
    };
    return {cell(low.x, size.x), cell(low.y, size.y), std::min(cell(high.x, size.x) + 1, size.x),
            std::min(cell(high.y, size.y) + 1, size.y)};
}

// visit(x, y) for the cells that a triangle may overlap, row by row: of each row those between its edges there, and a
// little more than rounding can misplace them. A needle across a page crosses few of the cells of its box.
template <class Visit>
void forEachCellNear(const std::array<glm::vec2, 3>& t, glm::uvec2 size, Visit&& visit) {
    constexpr double more = 0.125;  // cells; single precision is off by a hundredth at 16,384
    const CellRange r = cellRange(t, size);
    for (uint32_t y = r.y0; y < r.y1; ++y) {
        const double bottom = y - more, top = y + 1 + more;
        double low = 1e30, high = -1e30;
        for (size_t i = 0; i < 3; ++i) {
            glm::dvec2 a(t[i]), b(t[(i + 1) % 3]);
            if (a.y > b.y) std::swap(a, b);
            if (b.y < bottom || a.y > top) continue;
            const auto at = [&](double v) { return a.y < b.y ? a.x + (b.x - a.x) * ((v - a.y) / (b.y - a.y)) : a.x; };
            const double from = at(std::max(a.y, bottom)), to = a.y < b.y ? at(std::min(b.y, top)) : b.x;
            low = std::min({low, from, to}), high = std::max({high, from, to});
        }
        if (low > high) continue;
        const auto cell = [&](double v) {
            return static_cast<uint32_t>(std::clamp(v, static_cast<double>(r.x0), static_cast<double>(r.x1)));
        };
        const uint32_t first = cell(std::floor(low - more)), end = cell(std::floor(high + more) + 1);
        for (uint32_t x = first; x < end; ++x) visit(x, y);
    }
}

// Cells whose centre is strictly inside.
template <class Visit>
void forEachCoveredCentre(const std::array<glm::vec2, 3>& t, glm::uvec2 size, Visit&& visit) {
    constexpr float inside = 1e-4f;  // shared edges belong to neither
    forEachCellNear(t, size, [&](uint32_t x, uint32_t y) {
        const auto b = barycentric(t, glm::vec2(x, y) + 0.5f);
        if (b && b->x > inside && b->y > inside && b->x + b->y < 1 - inside) visit(x, y);
    });
}

// The part of a triangle inside the unit square at (x, y); empty when they do not overlap.
inline std::vector<glm::vec2> clipToCell(const std::array<glm::vec2, 3>& t, uint32_t x, uint32_t y) {
    std::vector<glm::vec2> polygon(t.begin(), t.end()), clipped;
    for (int side = 0; side < 4 && !polygon.empty(); ++side) {
        const int axis = side & 1;
        const float sign = side < 2 ? 1.0f : -1.0f;
        const float limit = static_cast<float>(axis ? y : x) + (side < 2 ? 0.0f : 1.0f);
        auto inside = [&](glm::vec2 p) { return sign * (p[axis] - limit); };
        clipped.clear();
        for (size_t i = 0; i < polygon.size(); ++i) {
            const glm::vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
            const float da = inside(a), db = inside(b);
            if (da >= 0) clipped.push_back(a);
            if ((da > 0 && db < 0) || (da < 0 && db > 0)) clipped.push_back(a + (b - a) * (da / (da - db)));
        }
        polygon.swap(clipped);
    }
    return polygon;
}

}  // namespace dimmer::cook
