#include <charts/unwrap.h>

#include <charts/curved.h>
#include <charts/file_uv.h>
#include <charts/planar.h>
#include <charts/raster.h>

#include <fmt/format.h>
#include <stb_rect_pack.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

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

// The file's own UVs, scaled to the wanted density on average: one chart, or where that takes fewer texels one for each
// piece of the unwrap, as those of a mesh may lie anywhere in an atlas of many.
std::vector<Placed> fileCharts(const RayScene& rays, Unwrap& out, const std::vector<uint32_t>& ids, float density,
                               uint32_t side_max) {
    const std::vector<Face>& faces = out.faces;
    const SceneMesh& mesh = rays.scene().meshes[rays.triangles()[faces[ids[0]].triangle].mesh];
    const auto triangleOf = [&](uint32_t id) { return rays.triangles()[faces[id].triangle].triangle; };
    const auto uvOf = [&](uint32_t id, int i) { return mesh.uv1[mesh.triangles[triangleOf(id)][i]]; };
    double area_m2 = 0, area_uv = 0;
    const auto add = [&](FileUvs& part, uint32_t id) {
        part.ids.push_back(id);
        for (int i = 0; i < 3; ++i)
            part.low = glm::min(part.low, uvOf(id, i)), part.high = glm::max(part.high, uvOf(id, i));
    };
    FileUvs whole;
    std::vector<uint32_t> triangles;
    for (uint32_t id : ids) {
        const auto c = corners(rays, faces[id]);
        area_m2 += 0.5 * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
        area_uv += 0.5 * std::abs(cross2d(uvOf(id, 1) - uvOf(id, 0), uvOf(id, 2) - uvOf(id, 0)));
        add(whole, id);
        triangles.push_back(triangleOf(id));
    }
    std::vector<FileUvs> parts;
    for (const auto& piece : unwrapPieces(mesh, triangles)) {
        FileUvs& part = parts.emplace_back();
        for (const uint32_t i : piece) add(part, ids[i]);
    }
    const float scale = density * static_cast<float>(std::sqrt(area_m2 / area_uv));
    const auto areaAt = [&](const FileUvs& part) {
        const glm::vec2 size = (part.high - part.low) * scale + static_cast<float>(2 * padding_texels);
        return double{size.x} * double{size.y};
    };
    double in_parts = 0;
    for (const FileUvs& part : parts) in_parts += areaAt(part);
    if (in_parts >= areaAt(whole)) parts = {std::move(whole)};
    std::vector<Placed> charts;
    for (FileUvs& part : parts) {
        const float extent = std::max(part.high.x - part.low.x, part.high.y - part.low.y);
        warnOfCoarseness(rays, out, part.ids[0], scale * extent, side_max);
        const float fits = std::min(scale, (static_cast<float>(side_max - 2 * padding_texels) - 1) / extent);
        const glm::uvec2 texels = part.texels(fits);
        Placed placed{texels.x, texels.y, std::move(part.ids), {}, true};
        for (uint32_t id : placed.faces) {
            std::array<glm::vec2, 3> uv;
            for (int i = 0; i < 3; ++i)
                uv[static_cast<size_t>(i)] = (uvOf(id, i) - part.low) * fits + static_cast<float>(padding_texels);
            placed.uv_texels.push_back(uv);
        }
        charts.push_back(std::move(placed));
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

bool tryPack(std::vector<stbrp_rect>& rects, int width, int height) {
    std::vector<stbrp_node> nodes(static_cast<size_t>(width));
    stbrp_context context;
    stbrp_init_target(&context, width, height, nodes.data(), width);
    return stbrp_pack_rects(&context, rects.data(), static_cast<int>(rects.size())) != 0;
}

std::vector<stbrp_rect> rectsOf(std::span<const glm::uvec2> charts, const std::vector<uint32_t>& ids) {
    std::vector<stbrp_rect> rects;
    for (uint32_t id : ids) {
        stbrp_rect r{};
        r.id = static_cast<int>(id);
        r.w = static_cast<stbrp_coord>(charts[id].x);
        r.h = static_cast<stbrp_coord>(charts[id].y);
        rects.push_back(r);
    }
    return rects;
}

// On square pages of `side`, as many as it takes; false where those are more than `count_max`. Pages end with the
// lowest chart of all.
bool fillPages(std::span<const glm::uvec2> charts, uint32_t side, uint32_t count_max, Unwrap& out) {
    std::vector<uint32_t> rest(charts.size());
    std::iota(rest.begin(), rest.end(), 0u);
    out.charts.resize(charts.size());
    uint32_t height = 0;
    for (out.page_count = 0; !rest.empty(); ++out.page_count) {
        if (out.page_count == count_max) return false;
        auto rects = rectsOf(charts, rest);
        tryPack(rects, static_cast<int>(side), static_cast<int>(side));
        rest.clear();
        for (const stbrp_rect& r : rects) {
            const auto id = static_cast<uint32_t>(r.id);
            if (!r.was_packed) {
                rest.push_back(id);
                continue;
            }
            const auto x = static_cast<uint32_t>(r.x), y = static_cast<uint32_t>(r.y);
            out.charts[id] = {out.page_count, x, y, charts[id].x, charts[id].y};
            height = std::max(height, y + charts[id].y);
        }
        std::ranges::sort(rest);
    }
    out.page_count = std::max(out.page_count, 1u);
    out.page_width = side;
    out.page_height = std::min(side, (height + 7) / 8 * 8);
    return true;
}

// As few pages as will do, and those as small as will do. Sides are multiples of 64 texels.
bool packPages(std::span<const glm::uvec2> charts, uint32_t page_size, Unwrap& out) {
    constexpr uint32_t side_step = 64, pages_max = 256;
    uint64_t area = 0;
    uint32_t largest = side_step;
    for (const glm::uvec2 c : charts) {
        area += uint64_t{c.x} * c.y;
        largest = std::max({largest, c.x, c.y});
    }
    const auto sideFor = [&](uint32_t pages) {
        const auto side = static_cast<uint32_t>(std::sqrt(static_cast<double>(area) / pages));
        return std::max((side + side_step - 1) / side_step, (largest + side_step - 1) / side_step) * side_step;
    };
    for (uint32_t side = sideFor(1); side <= page_size; side += side_step)
        if (fillPages(charts, side, 1, out)) return true;
    if (!fillPages(charts, page_size, pages_max, out)) return false;
    const uint32_t pages = out.page_count;
    for (uint32_t side = sideFor(pages); side < page_size; side += side_step)
        if (fillPages(charts, side, pages, out)) return true;
    return fillPages(charts, page_size, pages, out);
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

uint64_t pageTexels(std::span<const glm::uvec2> charts, uint32_t page_size) {
    Unwrap out;
    if (!packPages(charts, page_size, out)) return UINT64_MAX;
    return uint64_t{out.page_width} * out.page_height * out.page_count;
}

glm::uvec2 chartSize(glm::uvec2 size, double factor) {
    const auto side = [&](uint32_t texels) {
        // Sides were rounded up, but where they are whole metres: rather too large than too small.
        const double inner = static_cast<double>(texels - 2 * padding_texels) / factor;
        return static_cast<uint32_t>(std::max(1.0, std::ceil(inner - 0.01))) + 2 * padding_texels;
    };
    return factor == 1 ? size : glm::uvec2(side(size.x), side(size.y));
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
    if (!packPages(sizes, options.page_size, out))
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: the lightmap needs more than 256 pages of {} x {} texels; lower "
                                "lightmaps.texels_per_metre or raise lightmaps.page_size",
                                rays.scene().file, options.page_size, options.page_size));

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
