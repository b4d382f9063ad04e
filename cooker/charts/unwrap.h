// Charts: which texel of which lightmap page every lit face gets.
#pragma once

#include <trace/ray_scene.h>

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

namespace dimmer::cook {

inline constexpr uint32_t no_index = UINT32_MAX;

// One lit side of a level triangle. Double-sided materials have two.
struct Face {
    uint32_t triangle = 0;
    bool back = false;
};

// A rectangle of texels on a page; its outermost ring is padding for bilinear filtering.
struct Chart {
    uint32_t page = 0, x = 0, y = 0, width = 0, height = 0;
    bool curved = false;  // a surface that curves, or islands of a mesh's own unwrap; else it is of one plane
};

// A right- or left-handed tangent frame: `tangent` is the direction of increasing u, `bitangent` that of increasing v,
// made perpendicular to the normal and to each other. The shader's twin is dimmer_tangent_frame in sample.glsl.
struct TangentFrame {
    glm::vec3 tangent, bitangent, normal;
};

// Whether light from a direction is about the same in both: only then may directional light be mixed as it is stored.
bool sameFrame(const TangentFrame& a, const TangentFrame& b);

// The frame of a triangle from its corners' positions and lightmap UVs (in texels) and its unit normal; also the world
// area of one texel.
TangentFrame tangentFrame(const std::array<glm::vec3, 3>& positions_m, const std::array<glm::vec2, 3>& uv_texels,
                          glm::vec3 normal, float& texel_area_m2);

// Of a mesh of the scene, which the text does not name.
struct ChartWarning {
    uint32_t mesh = 0;
    std::string text;
};

struct Unwrap {
    uint32_t page_width = 0, page_height = 0, page_count = 0;
    std::vector<Face> faces;
    std::vector<std::array<glm::vec2, 3>> uv_texels;  // per face: its corners on the page, in texels
    std::vector<uint32_t> face_chart;
    std::vector<TangentFrame> frames;             // per face
    std::vector<float> texel_area_m2;             // per face
    std::vector<uint32_t> front_face, back_face;  // per level triangle; no_index where unlit
    std::vector<Chart> charts;
    std::vector<ChartWarning> warnings;

    uint32_t faceOf(uint32_t triangle, bool back) const { return (back ? back_face : front_face)[triangle]; }
    // Of what has an entry for each texel of all pages.
    size_t texelIndex(uint32_t page, uint32_t x, uint32_t y) const {
        return (size_t{page} * page_height + y) * page_width + x;
    }
};

inline constexpr uint32_t padding_texels = 1;  // around a chart

struct UnwrapOptions {
    float texels_per_metre = 4;
    uint32_t page_size = 2048;  // largest side of a page, at most 4096
};

// SceneMesh::uv1 is used where there is one, and must be an unwrap: cutAtWalls() sees to that. Everything else gets
// charts seen along their normal: faces that share an edge, coplanar or of a surface that curves gently, as long as no
// wall stands between parts that come close to one another (filtering would leak through it).
Expected<Unwrap> unwrap(const RayScene& rays, const UnwrapOptions& options);

}  // namespace dimmer::cook
