#include <charts/file_uv.h>

#include <charts/raster.h>

#include <bit>
#include <map>
#include <numeric>
#include <utility>

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

std::vector<std::vector<uint32_t>> unwrapPieces(const SceneMesh& mesh, std::span<const uint32_t> triangles) {
    std::vector<uint32_t> lower(triangles.size());  // a triangle of the same piece, or the piece's first itself
    std::iota(lower.begin(), lower.end(), 0u);
    const auto firstOf = [&](uint32_t i) {
        while (lower[i] != i) i = lower[i] = lower[lower[i]];
        return i;
    };
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> triangle_at;  // per corner of the unwrap, by its bits
    for (uint32_t i = 0; i < triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const glm::vec2 uv = mesh.uv1[mesh.triangles[triangles[i]][k]] + 0.0f;  // -0 is 0
            const std::pair corner(std::bit_cast<uint32_t>(uv.x), std::bit_cast<uint32_t>(uv.y));
            const uint32_t a = firstOf(i), b = firstOf(triangle_at.try_emplace(corner, i).first->second);
            lower[std::max(a, b)] = std::min(a, b);
        }
    std::vector<std::vector<uint32_t>> pieces;
    std::vector<uint32_t> piece_of(triangles.size());
    for (uint32_t i = 0; i < triangles.size(); ++i) {
        const uint32_t first = firstOf(i);
        if (first == i) {
            piece_of[i] = static_cast<uint32_t>(pieces.size());
            pieces.emplace_back();
        }
        pieces[piece_of[first]].push_back(i);
    }
    return pieces;
}

}  // namespace dimmer::cook
