#include <charts/file_uv.h>

#include <charts/groups.h>
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
// and leaks under walls that texels of the same density would not let it. A few odd triangles are no matter, nor is
// what is narrower than a texel and was given one.
constexpr double stretch_max = 2.5, stretched_share_max = 0.1;

// Charts are a texel wide at least, whatever lies on them; by rounding, a little more.
constexpr double narrow_texels = 1.01;

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

// A mesh's triangles with a piece of the unwrap each, and what the pieces take of it.
class PieceSizes {
   public:
    explicit PieceSizes(const SceneMesh& mesh) : size_of_(mesh.triangles.size()) {
        std::vector<uint32_t> all(mesh.triangles.size());
        std::iota(all.begin(), all.end(), 0u);
        for (const auto& piece : unwrapPieces(mesh, all)) {
            glm::vec2 low(1), high(0);
            for (const uint32_t t : piece)
                for (int k = 0; k < 3; ++k) {
                    const glm::vec2 uv = mesh.uv1[mesh.triangles[t][k]];
                    low = glm::min(low, uv), high = glm::max(high, uv);
                }
            for (const uint32_t t : piece) size_of_[t] = high - low;
        }
    }
    glm::vec2 operator[](size_t triangle) const { return size_of_[triangle]; }

   private:
    std::vector<glm::vec2> size_of_;
};

// visit(area_m2, scale, narrow) of every triangle; each has area in the unwrap.
void forEachScale(const SceneMesh& mesh, float texels_per_metre, auto&& visit) {
    const PieceSizes pieces(mesh);
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        std::array<glm::vec2, 3> uv;
        std::array<glm::vec3, 3> p;
        for (int i = 0; i < 3; ++i) {
            uv[static_cast<size_t>(i)] = mesh.uv1[mesh.triangles[t][i]];
            p[static_cast<size_t>(i)] = mesh.positions_m[mesh.triangles[t][i]];
        }
        const UnwrapScale scale = unwrapScale(uv, p);
        visit(glm::length(glm::dvec3(glm::cross(p[1] - p[0], p[2] - p[0]))) / 2, scale,
              isNarrow(scale, pieces[t], texels_per_metre));
    }
}

// An unwrap over pages that are no squares has texels that are none in its own units: the shorter side's are made as
// long in space, in the mean. One that is for squares keeps its bits.
void makeSquare(SceneMesh& mesh, float texels_per_metre) {
    constexpr double as_good_as_square = 1.1;
    double u_m2 = 0, v_m2 = 0;
    forEachScale(mesh, texels_per_metre, [&](double area_m2, const UnwrapScale& s, bool narrow) {
        if (narrow) return;
        const double longest = s.long_m * s.long_m, less = longest - s.short_m * s.short_m;
        u_m2 += area_m2 * (longest - less * s.short_way.x * s.short_way.x);
        v_m2 += area_m2 * (longest - less * s.short_way.y * s.short_way.y);
    });
    if (!(u_m2 > 0 && v_m2 > 0)) return;
    const double aspect = std::sqrt(v_m2 / u_m2);
    if (std::max(aspect, 1 / aspect) < as_good_as_square) return;
    const glm::vec2 scale(std::min(1.0, 1 / aspect), std::min(1.0, aspect));
    for (glm::vec2& uv : mesh.uv1) uv *= scale;
}

// Empty where texels are about as long as wide.
std::string stretchFault(const SceneMesh& mesh, float texels_per_metre) {
    double all_m2 = 0, stretched_m2 = 0, most = 0;
    forEachScale(mesh, texels_per_metre, [&](double area_m2, const UnwrapScale& scale, bool narrow) {
        all_m2 += area_m2;
        const double stretch = scale.long_m / scale.short_m;
        if (narrow || !(stretch > stretch_max)) return;
        stretched_m2 += area_m2;
        most = std::max(most, stretch);
    });
    const bool is_fault = stretched_m2 > stretched_share_max * all_m2;
    return is_fault ? fmt::format("they are stretched, up to {:.0f} : 1", most) : std::string();
}

// Why the mesh's TEXCOORD_1 is no unwrap, whatever its texels' shape; empty when it is one.
std::string unwrapFault(const SceneMesh& mesh) {
    const auto bounds = boundsOf(mesh);
    if (!bounds) return "they leave 0..1";
    const glm::vec2 span = bounds->high - bounds->low;
    if (std::min(span.x, span.y) < least_span) return "they span next to nothing";
    std::vector<uint8_t> taken(size_t{overlap_grid} * overlap_grid);
    const glm::vec2 grid = static_cast<float>(overlap_grid) / span;
    for (const glm::uvec3 triangle : mesh.triangles) {
        std::array<glm::vec2, 3> uv = {mesh.uv1[triangle.x], mesh.uv1[triangle.y], mesh.uv1[triangle.z]};
        if (std::abs(cross2d(uv[1] - uv[0], uv[2] - uv[0])) < 1e-12f) return "a triangle has no area in them";
        for (auto& c : uv) c = (c - bounds->low) * grid;
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

// What tools round to just beyond 0..1.
void clampRounding(std::vector<glm::vec2>& uvs) {
    for (glm::vec2& uv : uvs) {
        const glm::vec2 inside = glm::clamp(uv, 0.0f, 1.0f);
        for (int i = 0; i < 2; ++i)
            if (std::abs(uv[i] - inside[i]) <= rounding) uv[i] = inside[i];
    }
}

}  // namespace

// By the trace and the determinant of the map's transpose times the map.
UnwrapScale unwrapScale(const std::array<glm::vec2, 3>& uv, const std::array<glm::vec3, 3>& p) {
    const glm::dvec2 a = uv[1] - uv[0], b = uv[2] - uv[0];
    const glm::dvec3 ap = p[1] - p[0], bp = p[2] - p[0];
    const double area = a.x * b.y - a.y * b.x;
    const glm::dvec3 along_u = (ap * b.y - bp * a.y) / area, along_v = (bp * a.x - ap * b.x) / area;
    const double e = glm::dot(along_u, along_u), f = glm::dot(along_u, along_v), g = glm::dot(along_v, along_v);
    const double middle = (e + g) / 2, spread = std::sqrt(std::max(0.0, middle * middle - (e * g - f * f)));
    const double least = std::max(middle - spread, 1e-300);
    // Of the two rows of the matrix less its eigenvalue, what is across the longer.
    const glm::dvec2 one(f, least - e), other(least - g, f);
    const glm::dvec2 across = glm::dot(one, one) > glm::dot(other, other) ? one : other;
    const double length = glm::length(across);
    return {std::sqrt(middle + spread), std::sqrt(least), length > 0 ? across / length : glm::dvec2(1, 0)};
}

bool isNarrow(const UnwrapScale& scale, glm::vec2 piece, float texels_per_metre) {
    const double width_m = scale.short_m * glm::dot(glm::abs(scale.short_way), glm::dvec2(piece));
    return width_m * static_cast<double>(texels_per_metre) < narrow_texels;
}

void dropInvalidUnwraps(Scene& scene, float texels_per_metre) {
    for (SceneMesh& mesh : scene.meshes) {
        if (mesh.uv1.empty() || mesh.triangles.empty() || !hasLightmap(mesh)) continue;
        clampRounding(mesh.uv1);
        mesh.uv1_fault = unwrapFault(mesh);
        if (mesh.uv1_fault.empty()) {
            const float density = mesh.texels_per_metre.value_or(texels_per_metre);
            makeSquare(mesh, density);
            mesh.uv1_fault = stretchFault(mesh, density);
        }
        if (!mesh.uv1_fault.empty()) mesh.uv1.clear();
    }
}

std::vector<std::vector<uint32_t>> unwrapPieces(const SceneMesh& mesh, std::span<const uint32_t> triangles) {
    Groups groups(triangles.size());  // that the first triangle of each stands for
    // Per corner, by the bits of its places in the unwrap and in space: islands may touch.
    std::map<std::array<uint32_t, 5>, uint32_t> triangle_at;
    for (uint32_t i = 0; i < triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const uint32_t vertex = mesh.triangles[triangles[i]][k];
            const glm::vec2 uv = mesh.uv1[vertex] + 0.0f;  // -0 is 0
            const glm::vec3 p = mesh.positions_m[vertex] + 0.0f;
            const auto corner = std::bit_cast<std::array<uint32_t, 5>>(std::array{uv.x, uv.y, p.x, p.y, p.z});
            const uint32_t a = groups.find(i), b = groups.find(triangle_at.try_emplace(corner, i).first->second);
            if (a != b) groups.join(std::min(a, b), std::max(a, b));
        }
    std::vector<std::vector<uint32_t>> pieces;
    std::vector<uint32_t> piece_of(triangles.size());
    for (uint32_t i = 0; i < triangles.size(); ++i) {
        const uint32_t first = groups.find(i);
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
