#include <charts/unwrap.h>

#include <charts/axes.h>
#include <charts/curved.h>
#include <charts/file_uv.h>
#include <charts/pages.h>
#include <charts/planar.h>
#include <charts/raster.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace dimmer::cook {
namespace {

// A chart before it has a place: its size with padding, and its faces' corners relative to its rectangle.
struct Placed {
    uint32_t width = 0, height = 0;
    std::vector<uint32_t> faces;
    std::vector<std::array<glm::vec2, 3>> uv_texels;
    bool curved = false;
};

std::array<glm::vec3, 3> corners(const RayScene& rays, Face face) {
    std::array<glm::vec3, 3> c = {rays.corner(face.triangle, 0), rays.corner(face.triangle, 1),
                                  rays.corner(face.triangle, 2)};
    if (face.back) std::swap(c[1], c[2]);
    return c;
}

std::array<glm::vec3, 3> cornerNormals(const SceneMesh& mesh, uint32_t triangle, bool back) {
    std::array<glm::vec3, 3> n;
    for (int i = 0; i < 3; ++i)
        n[static_cast<size_t>(i)] = (back ? -1.0f : 1.0f) * mesh.normals[mesh.triangles[triangle][i]];
    if (back) std::swap(n[1], n[2]);
    return n;
}

std::vector<Face> listFaces(const RayScene& rays) {
    std::vector<Face> faces;
    const Scene& scene = rays.scene();
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
        const LevelTriangle& triangle = rays.triangles()[t];
        if (!hasLightmap(scene.meshes[triangle.mesh])) continue;
        faces.push_back({t, false});
        if (scene.materials[triangle.material].double_sided) faces.push_back({t, true});
    }
    return faces;
}

// A surface larger than a page is stored as coarse as fits one: told once for each node.
void warnOfCoarseness(const RayScene& rays, Unwrap& out, uint32_t face, float texels, uint32_t side_max) {
    const auto usable = static_cast<float>(side_max - 2 * padding_texels);
    if (!(texels > usable + 1)) return;
    const uint32_t mesh = rays.triangles()[out.faces[face].triangle].mesh;
    constexpr std::string_view what = "one of its surfaces is";
    const auto said = [&](const ChartWarning& w) {
        const int node = rays.scene().meshes[mesh].gltf_node;
        const bool same = w.mesh == mesh || (node >= 0 && rays.scene().meshes[w.mesh].gltf_node == node);
        return same && w.text.starts_with(what);
    };
    if (std::ranges::any_of(out.warnings, said)) return;
    out.warnings.push_back(
        {mesh, fmt::format("{} {:.0f} texels long, a page {}: it is stored {:.1f} times as coarse. Cut the surface, "
                           "raise lightmaps.page_size, or lower the density.",
                           what, texels, side_max, texels / usable)});
}

// What a mesh's own UVs cover of some faces, and the faces themselves.
struct FileUvs {
    std::vector<uint32_t> ids;
    glm::vec2 low{1}, high{0};
    glm::uvec2 texels(float scale) const { return glm::uvec2(glm::ceil((high - low) * scale)) + 2 * padding_texels; }
};

// Where a mesh's own UVs are to lie, as one chart or as one for each piece of the unwrap.
class FileUnwrap {
   public:
    FileUnwrap(const RayScene& rays, const std::vector<Face>& faces, const std::vector<uint32_t>& ids, float density,
               uint32_t side_max)
        : rays_(rays),
          faces_(faces),
          mesh_(rays.scene().meshes[rays.triangles()[faces[ids[0]].triangle].mesh]),
          usable_(static_cast<float>(side_max - 2 * padding_texels) - 1) {
        std::vector<uint32_t> triangles;
        for (uint32_t id : ids) {
            add(whole_, id);
            triangles.push_back(triangleOf(id));
        }
        for (const auto& piece : unwrapPieces(mesh_, triangles)) {
            FileUvs& part = pieces_.emplace_back();
            for (const uint32_t i : piece) add(part, ids[i]);
        }
        scale_ = density * static_cast<float>(metresPerUnit(density));
    }

    // Piece by piece where that takes fewer texels, as those of a mesh may lie anywhere in an atlas of many, or where
    // they would show each other's light: of gaps that were made for a larger page too little is left.
    std::vector<FileUvs> parts() const {
        double in_pieces = 0;
        for (const FileUvs& piece : pieces_) in_pieces += areaOf(piece);
        if (in_pieces < areaOf(whole_) || bleed()) return pieces_;
        return {whole_};
    }

    float texelsAcross(const FileUvs& part) const { return scale_ * extentOf(part); }

    Placed placed(const FileUvs& part) const {
        const float scale = scaleOf(part);
        const glm::uvec2 texels = part.texels(scale);
        Placed chart{texels.x, texels.y, part.ids, {}, true};
        for (const uint32_t id : part.ids) chart.uv_texels.push_back(placeOf(id, part, scale));
        return chart;
    }

   private:
    uint32_t triangleOf(uint32_t id) const { return rays_.triangles()[faces_[id].triangle].triangle; }
    glm::vec2 uvOf(uint32_t id, int i) const { return mesh_.uv1[mesh_.triangles[triangleOf(id)][i]]; }
    // The side of a square of the mesh over that of its unwrap, by area. What is narrower than a texel was widened: of
    // that, its length counts.
    double metresPerUnit(float density) const {
        double area_m2 = 0, area_uv = 0;
        for (const FileUvs& piece : pieces_)
            for (const uint32_t id : piece.ids) {
                const auto p = corners(rays_, faces_[id]);
                const std::array<glm::vec2, 3> uv = {uvOf(id, 0), uvOf(id, 1), uvOf(id, 2)};
                const double m2 = 0.5 * double{glm::length(glm::cross(p[1] - p[0], p[2] - p[0]))};
                const UnwrapScale scale = unwrapScale(uv, p);
                const bool narrow = isNarrow(scale, piece.high - piece.low, density);
                area_m2 += m2;
                area_uv += narrow ? m2 / (scale.long_m * scale.long_m)
                                  : 0.5 * std::abs(double{cross2d(uv[1] - uv[0], uv[2] - uv[0])});
            }
        return std::sqrt(area_m2 / area_uv);
    }
    static float extentOf(const FileUvs& part) { return std::max(part.high.x - part.low.x, part.high.y - part.low.y); }
    float scaleOf(const FileUvs& part) const { return std::min(scale_, usable_ / extentOf(part)); }

    void add(FileUvs& part, uint32_t id) const {
        part.ids.push_back(id);
        for (int i = 0; i < 3; ++i)
            part.low = glm::min(part.low, uvOf(id, i)), part.high = glm::max(part.high, uvOf(id, i));
    }

    double areaOf(const FileUvs& part) const {
        const glm::vec2 size = (part.high - part.low) * scale_ + static_cast<float>(2 * padding_texels);
        return double{size.x} * double{size.y};
    }

    std::array<glm::vec2, 3> placeOf(uint32_t id, const FileUvs& part, float scale) const {
        std::array<glm::vec2, 3> uv;
        for (int i = 0; i < 3; ++i)
            uv[static_cast<size_t>(i)] = (uvOf(id, i) - part.low) * scale + static_cast<float>(padding_texels);
        return uv;
    }

    bool bleed() const {
        if (pieces_.size() < 2) return false;
        const float scale = scaleOf(whole_);
        PlacedPieces placed(pieces_.size());
        for (size_t p = 0; p < pieces_.size(); ++p)
            for (const uint32_t id : pieces_[p].ids) placed[p].push_back(placeOf(id, whole_, scale));
        return piecesBleed(placed, whole_.texels(scale));
    }

    const RayScene& rays_;
    const std::vector<Face>& faces_;
    const SceneMesh& mesh_;
    float usable_, scale_ = 1;
    FileUvs whole_;
    std::vector<FileUvs> pieces_;
};

// The file's own UVs, scaled to the wanted density on average.
std::vector<Placed> fileCharts(const RayScene& rays, Unwrap& out, const std::vector<uint32_t>& ids, float density,
                               uint32_t side_max) {
    const FileUnwrap file(rays, out.faces, ids, density, side_max);
    std::vector<Placed> charts;
    for (const FileUvs& part : file.parts()) {
        warnOfCoarseness(rays, out, part.ids[0], file.texelsAcross(part), side_max);
        charts.push_back(file.placed(part));
    }
    return charts;
}

// A chart seen along one direction, its grid fitted so that the rectangle's edges fall on texel edges.
Placed projectedChart(const RayScene& rays, const std::vector<Face>& faces, const std::vector<uint32_t>& face_ids,
                      ProjectedChart chart, uint32_t side_max) {
    const float usable = static_cast<float>(side_max - 2 * padding_texels);
    const float largest = std::max(chart.size_m.x, chart.size_m.y);
    const float density = std::min(chart.texels_per_metre, usable / largest);
    const glm::vec2 texels = glm::clamp(glm::ceil(chart.size_m * density - 0.01f), glm::vec2(1), glm::vec2(usable));
    const glm::vec2 scale = texels / glm::max(chart.size_m, glm::vec2(1e-6f));
    Placed placed{static_cast<uint32_t>(texels.x) + 2 * padding_texels,
                  static_cast<uint32_t>(texels.y) + 2 * padding_texels,
                  {},
                  {},
                  chart.curved};
    for (uint32_t local : chart.faces) {
        const uint32_t id = face_ids[local];
        std::array<glm::vec2, 3> uv;
        const auto c = corners(rays, faces[id]);
        for (size_t i = 0; i < 3; ++i) {
            const glm::vec2 p(glm::dot(c[i], chart.u_axis), glm::dot(c[i], chart.v_axis));
            uv[i] = (p - chart.min_m) * scale + static_cast<float>(padding_texels);
        }
        if (faces[id].back) std::swap(uv[1], uv[2]);  // stored in the triangle's own corner order
        placed.faces.push_back(id);
        placed.uv_texels.push_back(uv);
    }
    return placed;
}

BoxTree boxesOf(const RayScene& rays) {
    std::vector<BoxTree::Box> boxes;
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) boxes.push_back(BoxTree::boxOf(corners(rays, {t, false})));
    return BoxTree(std::move(boxes));
}

std::vector<Placed> makeCharts(const RayScene& rays, const UnwrapOptions& options, Unwrap& out) {
    const Scene& scene = rays.scene();
    for (uint32_t m = 0; m < scene.meshes.size(); ++m)
        if (const std::string& fault = scene.meshes[m].uv1_fault; !fault.empty())
            out.warnings.push_back({m, fmt::format("TEXCOORD_1 is no lightmap unwrap ({}); charts were made", fault)});
    for (uint32_t m = 0; m < scene.meshes.size(); ++m)
        if (scene.meshes[m].uv1_crosses_walls)
            out.warnings.push_back({m,
                                    "thin walls stand on it, where its own TEXCOORD_1 goes on: light leaks past them; "
                                    "part the mesh and its unwrap there, or leave TEXCOORD_1 out"});
    std::vector<Placed> charts;
    std::vector<PlanarFace> planar;
    std::vector<uint32_t> planar_ids;
    std::map<uint32_t, std::vector<uint32_t>> file_faces;
    for (uint32_t id = 0; id < out.faces.size(); ++id) {
        const Face face = out.faces[id];
        const uint32_t m = rays.triangles()[face.triangle].mesh;
        const SceneMesh& mesh = scene.meshes[m];
        if (!mesh.uv1.empty() && !face.back) {
            file_faces[m].push_back(id);
            continue;
        }
        const glm::vec3 normal = rays.triangles()[face.triangle].normal;
        const uint32_t own = rays.triangles()[face.triangle].triangle;
        planar.push_back({corners(rays, face), face.back ? -normal : normal,
                          mesh.texels_per_metre.value_or(options.texels_per_metre), chartGroup(mesh),
                          mesh.triangle_regions.empty() ? 0 : mesh.triangle_regions[own],
                          cornerNormals(mesh, own, face.back)});
        planar_ids.push_back(id);
    }
    for (const auto& [m, ids] : file_faces)
        for (Placed& chart :
             fileCharts(rays, out, ids, scene.meshes[m].texels_per_metre.value_or(options.texels_per_metre),
                        options.page_size))
            charts.push_back(std::move(chart));
    const BoxTree triangles = boxesOf(rays);
    Standing standing;
    standing.blocked = [&](glm::vec3 a, glm::vec3 b) { return rays.blocked(a, b); };
    standing.inside = [&](glm::vec3 p, const Axes& axes) {
        const auto meetsBack = [&](glm::vec3 direction) {
            const auto hit = rays.nearest(p, direction, far_away_m, 0);
            return hit && hit->back && !scene.materials[rays.triangles()[hit->triangle].material].double_sided;
        };
        return (meetsBack(axes.u) && meetsBack(-axes.u)) || (meetsBack(axes.v) && meetsBack(-axes.v));
    };
    standing.triangles = [&](const BoxTree::Box& box) {
        std::vector<std::array<glm::vec3, 3>> found;
        for (const uint32_t t : triangles.touching(box)) found.push_back(corners(rays, {t, false}));
        return found;
    };
    const uint32_t side_max = options.page_size - 2 * padding_texels;
    for (ProjectedChart& c : joinCurved(planar, planarCharts(planar, side_max, standing), side_max, standing)) {
        warnOfCoarseness(rays, out, planar_ids[c.faces[0]], std::max(c.size_m.x, c.size_m.y) * c.texels_per_metre,
                         options.page_size);
        charts.push_back(projectedChart(rays, out.faces, planar_ids, std::move(c), options.page_size));
    }
    return charts;
}

}  // namespace

TangentFrame tangentFrame(const std::array<glm::vec3, 3>& p, const std::array<glm::vec2, 3>& uv, glm::vec3 normal,
                          float& texel_area_m2) {
    const glm::vec3 e1 = p[1] - p[0], e2 = p[2] - p[0];
    const glm::vec2 d1 = uv[1] - uv[0], d2 = uv[2] - uv[0];
    const float det = cross2d(d1, d2);
    const float inverse = std::abs(det) > 1e-20f ? 1 / det : 0;
    const glm::vec3 along_u = (e1 * d2.y - e2 * d1.y) * inverse, along_v = (e2 * d1.x - e1 * d2.x) * inverse;
    texel_area_m2 = glm::length(glm::cross(along_u, along_v));
    glm::vec3 tangent = along_u - normal * glm::dot(normal, along_u);
    const float length = glm::length(tangent);
    if (!(length > 0)) {
        const glm::vec3 any = std::abs(normal.x) > 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
        const glm::vec3 b = glm::normalize(glm::cross(normal, any));
        return {glm::cross(b, normal), b, normal};
    }
    tangent /= length;
    const glm::vec3 bitangent = glm::cross(normal, tangent);
    return {tangent, glm::dot(bitangent, along_v) < 0 ? -bitangent : bitangent, normal};
}

bool sameFrame(const TangentFrame& a, const TangentFrame& b) {
    constexpr float same_cos = 0.99f;
    return glm::dot(a.normal, b.normal) > same_cos && glm::dot(a.tangent, b.tangent) > same_cos &&
           glm::dot(a.bitangent, b.bitangent) > same_cos;
}

Expected<Unwrap> unwrap(const RayScene& rays, const UnwrapOptions& options) {
    Unwrap out;
    out.faces = listFaces(rays);
    if (out.faces.empty())
        return fail(ErrorCode::BadInput, rays.scene().file +
                                             ": no mesh receives a lightmap; give at least one node dimmer_lighting "
                                             "'lightmap' or remove 'none' and 'dynamic'");
    out.front_face.assign(rays.triangles().size(), no_index);
    out.back_face.assign(rays.triangles().size(), no_index);
    for (uint32_t id = 0; id < out.faces.size(); ++id)
        (out.faces[id].back ? out.back_face : out.front_face)[out.faces[id].triangle] = id;

    const std::vector<Placed> charts = makeCharts(rays, options, out);
    std::vector<glm::uvec2> sizes;
    for (const Placed& c : charts) sizes.emplace_back(c.width, c.height);
    const glm::vec3 size = rays.boundsMax() - rays.boundsMin();
    if (!packPages(sizes, options.page_size, out))
        return fail(
            ErrorCode::BadInput,
            fmt::format("{}: is {:.0f} x {:.0f} x {:.0f} m large, and its lightmap needs more than 256 pages of "
                        "{} x {} texels; is it in metres, as glTF has it? If so, lower "
                        "lightmaps.texels_per_metre or raise lightmaps.page_size",
                        rays.scene().file, size.x, size.y, size.z, options.page_size, options.page_size));

    const size_t count = out.faces.size();
    out.uv_texels.resize(count);
    out.face_chart.resize(count);
    out.frames.resize(count);
    out.texel_area_m2.resize(count);
    for (uint32_t c = 0; c < charts.size(); ++c) {
        out.charts[c].curved = charts[c].curved;
        for (size_t i = 0; i < charts[c].faces.size(); ++i) {
            const uint32_t id = charts[c].faces[i];
            const Face face = out.faces[id];
            for (size_t k = 0; k < 3; ++k)
                out.uv_texels[id][k] = charts[c].uv_texels[i][k] + glm::vec2(out.charts[c].x, out.charts[c].y);
            out.face_chart[id] = c;
            const glm::vec3 normal = rays.triangles()[face.triangle].normal;
            const std::array<glm::vec3, 3> p = {rays.corner(face.triangle, 0), rays.corner(face.triangle, 1),
                                                rays.corner(face.triangle, 2)};
            out.frames[id] = tangentFrame(p, out.uv_texels[id], face.back ? -normal : normal, out.texel_area_m2[id]);
        }
    }
    return out;
}

}  // namespace dimmer::cook
