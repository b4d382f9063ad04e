// The triangles of a level by the cells of a grid: to find those that reach into a small tetrahedron.
#pragma once

#include <trace/ray_scene.h>

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

// Immutable after construction; queries are thread-safe. `rays` must outlive it.
class TriangleCells {
   public:
    explicit TriangleCells(const RayScene& rays);

    // Replaces `out`: every triangle that reaches into the tetrahedron and few others, ascending. False where it
    // reaches over too many cells for this to be quick.
    bool findNear(const std::array<glm::vec3, 4>& corners, std::vector<uint32_t>& out) const;

   private:
    glm::ivec3 cellOf(glm::vec3 p) const;
    size_t index(glm::ivec3 c) const;
    // visit(cell) for those that the triangle's plane cuts within its box.
    void forEachCell(uint32_t triangle, auto&& visit) const;

    const RayScene& rays_;
    glm::vec3 origin_;
    float cell_m_;
    glm::ivec3 size_;
    std::vector<uint32_t> first_;  // per cell and one more, into triangles_
    std::vector<uint32_t> triangles_;
};

}  // namespace dimmer::cook
