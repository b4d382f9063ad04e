#include <charts/wall_cuts.h>

#include <charts/file_uv.h>
#include <charts/planar.h>
#include <charts/shared_edges.h>
#include <charts/standing_walls.h>
#include <charts/unwrap.h>
#include <charts/wall_parts.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <set>
#include <span>

namespace dimmer::cook {
namespace {

struct Source {
    uint32_t mesh, triangle;
};

class WallCutter {
   public:
    WallCutter(Scene& scene, float texels_per_metre, uint32_t page_size)
        : scene_(scene), side_max_texels_(static_cast<float>(page_size - 2 * padding_texels)) {
        const auto cuttable = [](const SceneMesh& mesh) { return hasLightmap(mesh) && mesh.uv1.empty(); };
        addFaces(texels_per_metre, cuttable);
        cuttable_ = faces_.size();
        addFaces(texels_per_metre, [&](const SceneMesh& mesh) { return hasLightmap(mesh) && !cuttable(mesh); });
        lightmapped_ = faces_.size();
        addFaces(texels_per_metre,
                 [&](const SceneMesh& mesh) { return !hasLightmap(mesh) && mesh.lighting != Lighting::Dynamic; });
        walls_ = StandingWalls(faces_, blocking());
    }

    void run() {
        const std::vector<ProjectedChart> charts = chartsOf(0, cuttable_);
        const std::vector<Parts> parts = partsOf(charts);
        uint32_t region = 0;
        std::map<uint32_t, Replacements> by_mesh;
        for (size_t c = 0; c < charts.size(); ++c) {
            if (parts[c].size() < 2) continue;
            for (const auto& part : parts[c]) {
                ++region;
                for (const Piece& piece : part)
                    by_mesh[sources_[piece.face].mesh][sources_[piece.face].triangle].push_back(
                        {piece, region, &charts[c]});
            }
        }
        markUncut();
        const std::vector<CutMesh> beside = closedMeshes();
        for (const auto& [mesh, replacements] : by_mesh) rebuild(scene_.meshes[mesh], replacements);
        splitSharedEdges(scene_, beside);
    }

   private:
    using Parts = std::vector<std::vector<Piece>>;  // of a chart, what its walls leave beside one another

    std::vector<ProjectedChart> chartsOf(size_t first, size_t end) const {
        constexpr uint32_t no_side_limit = 1u << 20;
        auto charts = planarCharts(std::span(faces_).subspan(first, end - first), no_side_limit);
        for (ProjectedChart& chart : charts)
            for (uint32_t& face : chart.faces) face += static_cast<uint32_t>(first);
        return charts;
    }

    std::vector<Parts> partsOf(const std::vector<ProjectedChart>& charts) const {
        std::vector<Parts> parts(charts.size());
        tbb::parallel_for(size_t{0}, charts.size(), [&](size_t c) { parts[c] = partsOf(charts[c]); });
        return parts;
    }

    // Meshes that bring an unwrap, with triangles that go on under walls.
    void markUncut() {
        for (const Parts& parts : partsOf(chartsOf(cuttable_, lightmapped_))) {
            std::map<uint32_t, uint32_t> parts_of;  // per face
            for (const auto& part : parts) {
                std::set<uint32_t> faces;
                for (const Piece& piece : part)
                    if (polygonWidth(piece.corners) > wall_margin_m) faces.insert(piece.face);
                for (const uint32_t face : faces)
                    if (++parts_of[face] > 1) scene_.meshes[sources_[face].mesh].uv1_crosses_walls = true;
            }
        }
    }

    // Those that cuts may change, before they do. A leaf's open and closed meshes stay alike.
    std::vector<CutMesh> closedMeshes() const {
        std::vector<CutMesh> meshes;
        for (size_t f = 0; f < cuttable_; ++f) {
            const uint32_t m = sources_[f].mesh;
            if (scene_.meshes[m].door || (!meshes.empty() && meshes.back().mesh == m)) continue;
            meshes.push_back({m, scene_.meshes[m].positions_m.size()});
        }
        return meshes;
    }

    struct Replacement {
        Piece piece;
        uint32_t region;
        const ProjectedChart* chart;
    };
    using Replacements = std::map<uint32_t, std::vector<Replacement>>;

    // Of the meshes that `wanted` takes.
    void addFaces(float texels_per_metre, auto&& wanted) {
        for (uint32_t m = 0; m < scene_.meshes.size(); ++m) {
            const SceneMesh& mesh = scene_.meshes[m];
            if (!wanted(mesh)) continue;
            for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
                std::array<glm::vec3, 3> c;
                for (int i = 0; i < 3; ++i) c[static_cast<size_t>(i)] = mesh.positions_m[mesh.triangles[t][i]];
                const glm::vec3 normal = glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]));
                faces_.push_back({c, normal, mesh.texels_per_metre.value_or(texels_per_metre), chartGroup(mesh)});
                sources_.push_back({m, t});
            }
        }
    }

    Blocking blocking() const {
        Blocking found;
        for (uint32_t f = 0; f < faces_.size(); ++f) {
            const Material& material =
                scene_.materials[scene_.meshes[sources_[f].mesh].triangle_materials[sources_[f].triangle]];
            if (material.alpha_mode != AlphaMode::Opaque) continue;
            found.faces.push_back(f);
            found.double_sided.push_back(material.double_sided);
        }
        return found;
    }

    // Texels per metre of its largest face, which has to fit a page.
    float coarsestOf(const ProjectedChart& chart) const {
        float largest_m = 0;
        for (const uint32_t face : chart.faces) {
            Rect rect;
            for (const glm::vec3 p : faces_[face].corners_m)
                rect.add({glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis)});
            const glm::vec2 size = rect.max - rect.min;
            largest_m = std::max({largest_m, size.x, size.y});
        }
        return std::min(chart.texels_per_metre, side_max_texels_ / largest_m);
    }

    Parts partsOf(const ProjectedChart& chart) const {
        const WallLines walls = walls_.on(chart, coarsestOf(chart));
        if (walls.lines.empty()) return {};
        std::vector<Piece> all;
        for (uint32_t face : chart.faces) {
            Piece piece{face, {}};
            for (glm::vec3 p : faces_[face].corners_m)
                piece.corners.push_back({glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis)});
            all.push_back(std::move(piece));
        }
        return partsBeside(walls, std::move(all), chart.texels_per_metre);
    }

    // Replaces the cut triangles of a mesh by their pieces, as fans.
    static void rebuild(SceneMesh& mesh, const Replacements& replacements) {
        std::vector<glm::uvec3> triangles;
        std::vector<uint32_t> materials, regions;
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const glm::uvec3 index = mesh.triangles[t];
            const auto it = replacements.find(t);
            if (it == replacements.end()) {
                triangles.push_back(index);
                materials.push_back(mesh.triangle_materials[t]);
                regions.push_back(0);
                continue;
            }
            for (const Replacement& r : it->second) {
                std::vector<uint32_t> corners;
                for (glm::vec2 p : r.piece.corners) corners.push_back(addVertex(mesh, index, *r.chart, p));
                for (size_t i = 2; i < corners.size(); ++i) {
                    const glm::vec3 a = mesh.positions_m[corners[0]], b = mesh.positions_m[corners[i - 1]],
                                    c = mesh.positions_m[corners[i]];
                    if (!(glm::length(glm::cross(b - a, c - a)) > 1e-9f)) continue;
                    triangles.push_back({corners[0], corners[i - 1], corners[i]});
                    materials.push_back(mesh.triangle_materials[t]);
                    regions.push_back(r.region);
                }
            }
        }
        mesh.triangles = std::move(triangles);
        mesh.triangle_materials = std::move(materials);
        mesh.triangle_regions = std::move(regions);
    }

    static uint32_t addVertex(SceneMesh& mesh, glm::uvec3 index, const ProjectedChart& chart, glm::vec2 p) {
        std::array<glm::vec2, 3> flat;
        for (int i = 0; i < 3; ++i) {
            const glm::vec3 corner = mesh.positions_m[index[i]];
            flat[static_cast<size_t>(i)] = {glm::dot(corner, chart.u_axis), glm::dot(corner, chart.v_axis)};
            if (flat[static_cast<size_t>(i)] == p) return index[i];
        }
        auto cross = [](glm::vec2 a, glm::vec2 b) { return a.x * b.y - a.y * b.x; };
        const float whole = cross(flat[1] - flat[0], flat[2] - flat[0]);
        const float u = cross(p - flat[0], flat[2] - flat[0]) / whole,
                    v = cross(flat[1] - flat[0], p - flat[0]) / whole;
        auto blend = [&](const auto& values) {
            return (1 - u - v) * values[index.x] + u * values[index.y] + v * values[index.z];
        };
        mesh.positions_m.push_back(blend(mesh.positions_m));
        const glm::vec3 normal = blend(mesh.normals);
        mesh.normals.push_back(glm::length(normal) > 1e-3f ? glm::normalize(normal) : mesh.normals[index.x]);
        if (!mesh.uv0.empty()) mesh.uv0.push_back(blend(mesh.uv0));
        return static_cast<uint32_t>(mesh.positions_m.size() - 1);
    }

    Scene& scene_;
    float side_max_texels_;
    std::vector<PlanarFace> faces_;
    std::vector<Source> sources_;
    // The first faces are those of meshes without an unwrap, the next of those with one; the others have no lightmap.
    size_t cuttable_ = 0, lightmapped_ = 0;
    StandingWalls walls_;
};

}  // namespace

void cutAtWalls(Scene& scene, float texels_per_metre, uint32_t page_size) {
    dropInvalidUnwraps(scene, texels_per_metre);
    WallCutter(scene, texels_per_metre, page_size).run();
}

}  // namespace dimmer::cook
