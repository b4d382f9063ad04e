#include <charts/file_uv.h>

#include <charts/raster.h>

namespace dimmer::cook {
namespace {

// Overlaps of a file's own UVs are looked for on a grid this fine.
constexpr uint32_t overlap_grid = 1024;

// Why the mesh's TEXCOORD_1 is no unwrap; empty when it is one.
std::string unwrapFault(const SceneMesh& mesh) {
    std::vector<uint8_t> taken(size_t{overlap_grid} * overlap_grid);
    const float grid = overlap_grid;
    for (const glm::uvec3 triangle : mesh.triangles) {
        std::array<glm::vec2, 3> uv;
        for (int i = 0; i < 3; ++i) {
            uv[static_cast<size_t>(i)] = mesh.uv1[triangle[i]];
            const glm::vec2 c = uv[static_cast<size_t>(i)];
            if (!(c.x >= 0 && c.x <= 1 && c.y >= 0 && c.y <= 1)) return "they leave 0..1";
        }
        if (std::abs(cross2d(uv[1] - uv[0], uv[2] - uv[0])) < 1e-12f) return "a triangle has no area in them";
        for (auto& c : uv) c *= grid;
        bool overlaps = false;
        forEachCoveredCentre(uv, {overlap_grid, overlap_grid}, [&](uint32_t x, uint32_t y) {
            uint8_t& cell = taken[size_t{y} * overlap_grid + x];
            overlaps = overlaps || cell != 0;
            cell = 1;
        });
        if (overlaps) return "they overlap";
    }
    return {};
}

}  // namespace

void dropInvalidUnwraps(Scene& scene) {
    for (SceneMesh& mesh : scene.meshes) {
        if (mesh.uv1.empty() || mesh.triangles.empty() || !hasLightmap(mesh)) continue;
        mesh.uv1_fault = unwrapFault(mesh);
        if (!mesh.uv1_fault.empty()) mesh.uv1.clear();
    }
}

}  // namespace dimmer::cook
