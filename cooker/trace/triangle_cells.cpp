#include <trace/triangle_cells.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace dimmer::cook {
namespace {

// As probes stand some 0.3 to 1 m apart, a tetrahedron covers a few dozen cells.
constexpr float cell_min_m = 0.5f;
constexpr float cells_per_axis_max = 160;  // 16 MB at most
constexpr int64_t cells_per_query_max = 20000;
// Surfaces that end in a cell's side belong to both cells.
constexpr float margin_m = 1e-4f;

// A plane: dot(normal, x) = offset.
struct Plane {
    glm::vec3 normal;
    float offset;
    float distance(glm::vec3 p) const { return glm::dot(normal, p) - offset; }
    // Of a box's corners, the least and the largest distance from its centre's.
    float reach(glm::vec3 half) const { return glm::dot(glm::abs(normal), half); }
};

// The sides of a tetrahedron, normals pointing outwards.
std::array<Plane, 4> sidesOf(const std::array<glm::vec3, 4>& corners) {
    std::array<Plane, 4> sides;
    for (size_t i = 0; i < 4; ++i) {
        const glm::vec3 a = corners[(i + 1) % 4], b = corners[(i + 2) % 4], c = corners[(i + 3) % 4];
        glm::vec3 normal = glm::cross(b - a, c - a);
        if (const float length = glm::length(normal); length > 0) normal /= length;
        if (glm::dot(normal, corners[i] - a) > 0) normal = -normal;
        sides[i] = {normal, glm::dot(normal, a)};
    }
    return sides;
}

bool isBeyond(const std::array<Plane, 4>& sides, auto&& beyond) {
    return std::ranges::any_of(sides, beyond);
}

// Whether a triangle may reach into the tetrahedron.
bool reaches(const RayScene& rays, uint32_t triangle, const std::array<glm::vec3, 4>& corners,
             const std::array<Plane, 4>& sides) {
    const glm::vec3 a = rays.corner(triangle, 0), b = rays.corner(triangle, 1), c = rays.corner(triangle, 2);
    if (isBeyond(sides, [&](const Plane& s) {
            return std::min({s.distance(a), s.distance(b), s.distance(c)}) > margin_m;
        }))
        return false;
    const glm::vec3 normal = rays.triangles()[triangle].normal;
    const Plane plane{normal, glm::dot(normal, a)};
    std::array<float, 4> off;
    for (size_t i = 0; i < 4; ++i) off[i] = plane.distance(corners[i]);
    return !(std::ranges::min(off) > margin_m || std::ranges::max(off) < -margin_m);
}

}  // namespace

TriangleCells::TriangleCells(const RayScene& rays) : rays_(rays), origin_(rays.boundsMin()) {
    const glm::vec3 extent = rays.boundsMax() - origin_;
    cell_m_ = std::max(cell_min_m, std::max({extent.x, extent.y, extent.z}) / cells_per_axis_max);
    size_ = glm::ivec3(glm::floor(extent / cell_m_)) + 1;
    first_.assign(static_cast<size_t>(size_.x) * static_cast<size_t>(size_.y) * static_cast<size_t>(size_.z) + 1, 0);
    const auto count = static_cast<uint32_t>(rays.triangles().size());
    for (uint32_t t = 0; t < count; ++t) forEachCell(t, [&](size_t cell) { ++first_[cell + 1]; });
    for (size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
    triangles_.resize(first_.back());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t t = 0; t < count; ++t) forEachCell(t, [&](size_t cell) { triangles_[next[cell]++] = t; });
}

glm::ivec3 TriangleCells::cellOf(glm::vec3 p) const {
    return glm::clamp(glm::ivec3(glm::floor((p - origin_) / cell_m_)), glm::ivec3(0), size_ - 1);
}

size_t TriangleCells::index(glm::ivec3 c) const {
    return (static_cast<size_t>(c.z) * static_cast<size_t>(size_.y) + static_cast<size_t>(c.y)) *
               static_cast<size_t>(size_.x) +
           static_cast<size_t>(c.x);
}

void TriangleCells::forEachCell(uint32_t triangle, auto&& visit) const {
    const glm::vec3 a = rays_.corner(triangle, 0), b = rays_.corner(triangle, 1), c = rays_.corner(triangle, 2);
    const glm::ivec3 low = cellOf(glm::min(a, glm::min(b, c)) - margin_m);
    const glm::ivec3 high = cellOf(glm::max(a, glm::max(b, c)) + margin_m);
    const glm::vec3 normal = rays_.triangles()[triangle].normal;
    const Plane plane{normal, glm::dot(normal, a)};
    const glm::vec3 half(0.5f * cell_m_ + margin_m);
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                const glm::vec3 centre = origin_ + (glm::vec3(x, y, z) + 0.5f) * cell_m_;
                // A triangle without a normal is kept: the comparison with what is not a number is false.
                if (!(std::abs(plane.distance(centre)) > plane.reach(half))) visit(index({x, y, z}));
            }
}

bool TriangleCells::findNear(const std::array<glm::vec3, 4>& corners, std::vector<uint32_t>& out) const {
    out.clear();
    // Which triangles this query has met already: most lie in several cells.
    thread_local std::vector<uint64_t> met;
    thread_local uint64_t query = 0;
    if (met.size() < rays_.triangles().size()) met.resize(rays_.triangles().size(), 0);
    ++query;
    glm::vec3 least = corners[0], most = corners[0];
    for (const glm::vec3& p : corners) least = glm::min(least, p), most = glm::max(most, p);
    const glm::ivec3 low = cellOf(least - margin_m), high = cellOf(most + margin_m);
    const glm::i64vec3 span = glm::i64vec3(high - low) + int64_t{1};
    if (span.x * span.y * span.z > cells_per_query_max) return false;
    const std::array<Plane, 4> sides = sidesOf(corners);
    const glm::vec3 half(0.5f * cell_m_ + margin_m);
    std::array<Plane, 4> farthest = sides;  // of the centres of cells that reach into it
    for (Plane& side : farthest) side.offset += side.reach(half);
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                const size_t cell = index({x, y, z});
                if (first_[cell] == first_[cell + 1]) continue;
                const glm::vec3 centre = origin_ + (glm::vec3(x, y, z) + 0.5f) * cell_m_;
                if (isBeyond(farthest, [&](const Plane& s) { return s.distance(centre) > 0; })) continue;
                for (uint32_t i = first_[cell]; i < first_[cell + 1]; ++i)
                    if (const uint32_t t = triangles_[i];
                        std::exchange(met[t], query) != query && reaches(rays_, t, corners, sides))
                        out.push_back(t);
            }
    std::ranges::sort(out);
    return true;
}

}  // namespace dimmer::cook
