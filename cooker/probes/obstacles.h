// What stands between the points of a tetrahedron and its corners.
#pragma once

#include <trace/triangle_cells.h>

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

using Barycentric = std::array<float, 4>;

// Of the way from a point to a corner.
struct Obstacle {
    bool any = false;
    bool back = false;             // the first is met from behind
    uint32_t first = 0, last = 0;  // of the level's triangles: the nearest to the point, and to the corner
    float share = 0;               // of the way to the corner, up to the first
};

// Small tetrahedra are asked about the few triangles in them, eight at a time; large ones, and what one can see
// through, ask rays.
class Obstacles {
   public:
    // `cells` may be null: rays are asked.
    Obstacles(const RayScene& rays, const TriangleCells* cells, const std::array<glm::vec3, 4>& corners);

    // Nothing reaches into the tetrahedron.
    bool none() const { return !by_rays_ && count_ == 0; }
    // On the ways from a point to each of the corners that are `wanted`.
    std::array<Obstacle, 4> from(const Barycentric& point, const std::array<bool, 4>& wanted) const;
    glm::vec3 position(const Barycentric& point) const;
    // Signed distances of the corners from a triangle's plane.
    Barycentric field(uint32_t triangle) const;

   private:
    static constexpr size_t lanes = 8, triangles_max = 64;
    using Lanes [[gnu::vector_size(32)]] = float;
    // Something that is linear over the tetrahedron, by its values at the corners: of each triangle.
    using Fields = std::array<std::array<Lanes, triangles_max / lanes>, 4>;
    void prepare(const std::vector<uint32_t>& near);
    static bool isClear(const Barycentric& distance, const Barycentric& second, const Barycentric& third);
    Obstacle byRays(glm::vec3 from, size_t corner) const;

    const RayScene& rays_;
    const std::array<glm::vec3, 4> corners_;
    bool by_rays_ = true;
    size_t count_ = 0;
    std::array<uint32_t, triangles_max> triangles_;
    // The distance from the plane, and the barycentric weights of the point of the plane below.
    Fields distance_, second_, third_;
};

}  // namespace dimmer::cook
