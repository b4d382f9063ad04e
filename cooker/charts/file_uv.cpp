#include <charts/file_uv.h>

#include <charts/polygon.h>
#include <charts/raster.h>
#include <charts/unwrap.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

namespace dimmer::cook {
namespace {

// Overlaps of a file's own UVs are looked for on a grid of so many cells over what the mesh takes of the unwrap, which
// of an atlas may be little.
constexpr uint32_t overlap_grid = 1024;
// Of the unwrap: less is a quarter of a texel of a page with 4096.
constexpr float least_span = 1.0f / 16384;
// As far beyond 0..1 as tools round, and far less than a texel.
constexpr float rounding = 1e-5f;

// Texels are sized by their area: where most of a mesh's are this many times as long as wide, light blurs along them
// and leaks under walls that texels of the same density would not let it. A few odd triangles are no matter.
constexpr double stretch_max = 2.5, stretched_share_max = 0.1;

// Of a texel: what reaches into it by less is rounding.
constexpr float least_share = 1e-4f;

struct UvBounds {
    glm::vec2 low{1}, high{0};
};

std::optional<UvBounds> boundsOf(const SceneMesh& mesh) {
    UvBounds bounds;
    for (const glm::uvec3 triangle : mesh.triangles)
        for (int i = 0; i < 3; ++i) {
            const glm::vec2 c = mesh.uv1[triangle[i]];
            if (!(c.x >= 0 && c.x <= 1 && c.y >= 0 && c.y <= 1)) return std::nullopt;
            bounds.low = glm::min(bounds.low, c);
            bounds.high = glm::max(bounds.high, c);
        }
    return bounds;
}

// How many times as long as wide a texel of the triangle is: the ratio of the singular values of its map from the
// unwrap to space, by the trace and the determinant of the map times its transpose.
double stretchOf(const std::array<glm::vec2, 3>& uv, const std::array<glm::vec3, 3>& p) {
    const glm::dvec2 a = uv[1] - uv[0], b = uv[2] - uv[0];
    const glm::dvec3 ap = p[1] - p[0], bp = p[2] - p[0];
    const double area = a.x * b.y - a.y * b.x;
    const glm::dvec3 along_u = (ap * b.y - bp * a.y) / area, along_v = (bp * a.x - ap * b.x) / area;
    const double e = glm::dot(along_u, along_u), f = glm::dot(along_u, along_v), g = glm::dot(along_v, along_v);
    const double middle = (e + g) / 2, spread = std::sqrt(std::max(0.0, middle * middle - (e * g - f * f)));
    return std::sqrt((middle + spread) / std::max(middle - spread, 1e-300));
}

// Why the mesh's TEXCOORD_1 is no unwrap; empty when it is one.
std::string unwrapFault(const SceneMesh& mesh) {
    const auto bounds = boundsOf(mesh);
    if (!bounds) return "they leave 0..1";
    const glm::vec2 span = bounds->high - bounds->low;
    if (std::min(span.x, span.y) < least_span) return "they span next to nothing";
    std::vector<uint8_t> taken(size_t{overlap_grid} * overlap_grid);
    const glm::vec2 grid = static_cast<float>(overlap_grid) / span;
    double all_m2 = 0, stretched_m2 = 0, most = 0;
    for (const glm::uvec3 triangle : mesh.triangles) {
        std::array<glm::vec2, 3> uv;
        std::array<glm::vec3, 3> p;
        for (int i = 0; i < 3; ++i) {
            uv[static_cast<size_t>(i)] = mesh.uv1[triangle[i]];
            p[static_cast<size_t>(i)] = mesh.positions_m[triangle[i]];
        }
        if (std::abs(cross2d(uv[1] - uv[0], uv[2] - uv[0])) < 1e-12f) return "a triangle has no area in them";
        const double area_m2 = glm::length(glm::dvec3(glm::cross(p[1] - p[0], p[2] - p[0]))) / 2;
        const double stretch = stretchOf(uv, p);
        all_m2 += area_m2;
        if (stretch > stretch_max) {
            stretched_m2 += area_m2;
            most = std::max(most, stretch);
        }
        for (auto& c : uv) c = (c - bounds->low) * grid;
        bool overlaps = false;
        forEachCoveredCentre(uv, {overlap_grid, overlap_grid}, [&](uint32_t x, uint32_t y) {
            uint8_t& cell = taken[size_t{y} * overlap_grid + x];
            overlaps = overlaps || cell != 0;
            cell = 1;
        });
        if (overlaps) return "they overlap";
    }
    if (stretched_m2 > stretched_share_max * all_m2) return fmt::format("they are stretched, up to {:.0f} : 1", most);
    return {};
}

// What tools round to just beyond 0..1.
void clampRounding(std::vector<glm::vec2>& uvs) {
    for (glm::vec2& uv : uvs) {
        const glm::vec2 inside = glm::clamp(uv, 0.0f, 1.0f);
        for (int i = 0; i < 2; ++i)
            if (std::abs(uv[i] - inside[i]) <= rounding) uv[i] = inside[i];
    }
}

}  // namespace

void dropInvalidUnwraps(Scene& scene) {
    for (SceneMesh& mesh : scene.meshes) {
        if (mesh.uv1.empty() || mesh.triangles.empty() || !hasLightmap(mesh)) continue;
        clampRounding(mesh.uv1);
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
    // Per corner, by the bits of its places in the unwrap and in space: islands may touch.
    std::map<std::array<uint32_t, 5>, uint32_t> triangle_at;
    for (uint32_t i = 0; i < triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const uint32_t vertex = mesh.triangles[triangles[i]][k];
            const glm::vec2 uv = mesh.uv1[vertex] + 0.0f;  // -0 is 0
            const glm::vec3 p = mesh.positions_m[vertex] + 0.0f;
            const auto corner = std::bit_cast<std::array<uint32_t, 5>>(std::array{uv.x, uv.y, p.x, p.y, p.z});
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

bool piecesBleed(const PlacedPieces& pieces, glm::uvec2 size) {
    constexpr uint32_t nothing = UINT32_MAX, several = UINT32_MAX - 1;
    // A texel beside two pieces is padding of one alone.
    constexpr uint32_t reach = 2 * padding_texels;
    std::vector<uint32_t> owner(size_t{size.x} * size.y, nothing);
    for (uint32_t p = 0; p < pieces.size(); ++p)
        for (const auto& triangle : pieces[p])
            forEachCellNear(triangle, size, [&](uint32_t x, uint32_t y) {
                uint32_t& cell = owner[size_t{y} * size.x + x];
                if (cell != p && polygonArea(clipToCell(triangle, x, y)) > least_share)
                    cell = cell == nothing ? p : several;
            });
    const auto others = [&](uint32_t x, uint32_t y) {
        const uint32_t own = owner[size_t{y} * size.x + x];
        for (uint32_t v = std::max(y, reach) - reach; v <= std::min(y + reach, size.y - 1); ++v)
            for (uint32_t u = std::max(x, reach) - reach; u <= std::min(x + reach, size.x - 1); ++u)
                if (const uint32_t near = owner[size_t{v} * size.x + u]; near != own && near != nothing) return true;
        return own == several;
    };
    size_t covered = 0, mixed = 0;
    for (uint32_t y = 0; y < size.y; ++y)
        for (uint32_t x = 0; x < size.x; ++x) {
            if (owner[size_t{y} * size.x + x] == nothing) continue;
            ++covered;
            mixed += others(x, y);
        }
    return 100 * mixed > covered;
}

}  // namespace dimmer::cook
