#include <charts/smooth_seams.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

namespace dimmer::cook {
namespace {

// A column of eight sides bends by 45 degrees at each edge.
constexpr float seam_bend_cos_min = 0.7f, shared_normal_cos = 0.998f, flat_shading_cos = 0.9999f;
constexpr float seam_places_per_m = 2000;  // ends of edges in the same place

using Place = std::array<int64_t, 3>;

Place seamPlaceOf(glm::vec3 p) {
    const auto step = [](float v) { return static_cast<int64_t>(std::llround(double{v} * seam_places_per_m)); };
    return {step(p.x), step(p.y), step(p.z)};
}

struct RoundEdge {
    Place low, high;
    uint32_t face, chart;
    glm::vec3 normal_low, normal_high;
};

// Of faces whose shading normals are not their own.
std::vector<RoundEdge> roundEdges(const RayScene& rays, const Unwrap& unwrap) {
    std::vector<RoundEdge> edges;
    for (uint32_t f = 0; f < unwrap.faces.size(); ++f) {
        const Face face = unwrap.faces[f];
        const LevelTriangle& triangle = rays.triangles()[face.triangle];
        const SceneMesh& mesh = rays.scene().meshes[triangle.mesh];
        std::array<glm::vec3, 3> normals;
        for (int i = 0; i < 3; ++i)
            normals[static_cast<size_t>(i)] =
                (face.back ? -1.0f : 1.0f) * mesh.normals[mesh.triangles[triangle.triangle][i]];
        const glm::vec3 own = unwrap.frames[f].normal;
        if (std::ranges::all_of(normals, [&](glm::vec3 n) { return glm::dot(n, own) > flat_shading_cos; })) continue;
        for (int i = 0; i < 3; ++i) {
            const int to = (i + 1) % 3;
            Place a = seamPlaceOf(rays.corner(face.triangle, i)), b = seamPlaceOf(rays.corner(face.triangle, to));
            glm::vec3 at_a = normals[static_cast<size_t>(i)], at_b = normals[static_cast<size_t>(to)];
            if (a == b) continue;
            if (b < a) std::swap(a, b), std::swap(at_a, at_b);
            edges.push_back({a, b, f, unwrap.face_chart[f], at_a, at_b});
        }
    }
    std::ranges::sort(edges, {}, [](const RoundEdge& e) { return std::tie(e.low, e.high, e.face); });
    return edges;
}

}  // namespace

SmoothSeams::SmoothSeams(const RayScene& rays, const Unwrap& unwrap) {
    const std::vector<RoundEdge> edges = roundEdges(rays, unwrap);
    const auto shadedAsOne = [&](const RoundEdge& a, const RoundEdge& b) {
        return glm::dot(unwrap.frames[a.face].normal, unwrap.frames[b.face].normal) > seam_bend_cos_min &&
               glm::dot(a.normal_low, b.normal_low) > shared_normal_cos &&
               glm::dot(a.normal_high, b.normal_high) > shared_normal_cos;
    };
    for (size_t i = 0; i < edges.size(); ++i)
        for (size_t k = i + 1;
             k < edges.size() && std::tie(edges[k].low, edges[k].high) == std::tie(edges[i].low, edges[i].high); ++k) {
            if (edges[i].chart == edges[k].chart || !shadedAsOne(edges[i], edges[k])) continue;
            pairs_.insert({edges[i].chart, edges[k].chart});
            pairs_.insert({edges[k].chart, edges[i].chart});
        }
}

bool SmoothSeams::any(uint32_t chart) const {
    const auto first = pairs_.lower_bound({chart, 0});
    return first != pairs_.end() && first->first == chart;
}

}  // namespace dimmer::cook
