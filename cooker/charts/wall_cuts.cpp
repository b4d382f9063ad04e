#include <charts/wall_cuts.h>

#include <charts/file_uv.h>
#include <charts/planar.h>
#include <charts/polygon.h>
#include <charts/standing_walls.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <span>

namespace dimmer::cook {
namespace {

constexpr float length_min_texels = 3;   // of all stretches between doorways; a table's leg is no wall
constexpr float wall_share_min = 0.25f;  // of a wall with its doorways

// A convex piece of a level triangle in its chart's plane.
struct Piece {
    uint32_t face;
    Polygon corners;
};

struct Source {
    uint32_t mesh, triangle;
};

class WallCutter {
   public:
    WallCutter(Scene& scene, float texels_per_metre) : scene_(scene) {
        const auto cuttable = [](const SceneMesh& mesh) { return hasLightmap(mesh) && mesh.uv1.empty(); };
        addFaces(texels_per_metre, cuttable);
        cuttable_ = faces_.size();
        addFaces(texels_per_metre, [&](const SceneMesh& mesh) { return hasLightmap(mesh) && !cuttable(mesh); });
        lightmapped_ = faces_.size();
        addFaces(texels_per_metre,
                 [&](const SceneMesh& mesh) { return !hasLightmap(mesh) && mesh.lighting != Lighting::Dynamic; });
        walls_ = StandingWalls(faces_, blocking());
    }

    // Along::Edges: charts that are turned alone; the others have been cut before.
    void run(Along along) {
        const std::vector<PlanarChart> charts = chartsOf(0, cuttable_, along);
        const std::vector<Parts> parts = partsOf(charts);
        uint32_t region = last_region_;
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
        markUncut(along);
        for (const auto& [mesh, replacements] : by_mesh) rebuild(scene_.meshes[mesh], replacements);
    }

   private:
    using Parts = std::vector<std::vector<Piece>>;  // of a chart, what its walls leave beside one another

    std::vector<PlanarChart> chartsOf(size_t first, size_t end, Along along) const {
        constexpr uint32_t no_side_limit = 1u << 20;
        auto charts = planarCharts(std::span(faces_).subspan(first, end - first), no_side_limit, {}, along);
        if (along == Along::Edges) std::erase_if(charts, [](const PlanarChart& chart) { return !chart.turned; });
        for (PlanarChart& chart : charts)
            for (uint32_t& face : chart.faces) face += static_cast<uint32_t>(first);
        return charts;
    }

    std::vector<Parts> partsOf(const std::vector<PlanarChart>& charts) const {
        std::vector<Parts> parts(charts.size());
        tbb::parallel_for(size_t{0}, charts.size(), [&](size_t c) { parts[c] = partsOf(charts[c]); });
        return parts;
    }

    // Meshes that bring an unwrap, with triangles that go on under walls.
    void markUncut(Along along) {
        for (const Parts& parts : partsOf(chartsOf(cuttable_, lightmapped_, along))) {
            std::map<uint32_t, uint32_t> parts_of;  // per face
            for (const auto& part : parts) {
                std::set<uint32_t> faces;
                for (const Piece& piece : part) faces.insert(piece.face);
                for (const uint32_t face : faces)
                    if (++parts_of[face] > 1) scene_.meshes[sources_[face].mesh].uv1_crosses_walls = true;
            }
        }
    }

    struct Replacement {
        Piece piece;
        uint32_t region;
        const PlanarChart* chart;
    };
    using Replacements = std::map<uint32_t, std::vector<Replacement>>;

    static uint32_t regionOf(const SceneMesh& mesh, uint32_t triangle) {
        return mesh.triangle_regions.empty() ? 0 : mesh.triangle_regions[triangle];
    }

    // Of the meshes that `wanted` takes.
    void addFaces(float texels_per_metre, auto&& wanted) {
        for (uint32_t m = 0; m < scene_.meshes.size(); ++m) {
            const SceneMesh& mesh = scene_.meshes[m];
            if (!wanted(mesh)) continue;
            for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
                std::array<glm::vec3, 3> c;
                for (int i = 0; i < 3; ++i) c[static_cast<size_t>(i)] = mesh.positions_m[mesh.triangles[t][i]];
                const glm::vec3 normal = glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]));
                const uint32_t region = regionOf(mesh, t);
                last_region_ = std::max(last_region_, region);
                faces_.push_back(
                    {c, normal, mesh.texels_per_metre.value_or(texels_per_metre), chartGroup(mesh), region});
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

    Parts partsOf(const PlanarChart& chart) const {
        const std::vector<WallLine> cuts = walls_.on(chart);
        if (cuts.empty()) return {};
        std::vector<Piece> all;
        for (uint32_t face : chart.faces) {
            Piece piece{face, {}};
            for (glm::vec3 p : faces_[face].corners_m)
                piece.corners.push_back({glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis)});
            all.push_back(std::move(piece));
        }
        return split(std::move(all), cuts, chart.texels_per_metre);
    }

    // Between two ends, with what goes on beyond doorways: at a few texels per metre no stretch between them is long. A
    // row of pillars, most of which is gap, is none. `cuts` ascend as StandingWalls has them.
    static float wallLength(const WallLine& cut, const std::vector<WallLine>& cuts, float low, float high) {
        float whole = 0, first = high, last = low;
        const auto place = [](const WallLine& c) { return std::pair(c.axis, c.at); };
        const float reach_m = same_line_m + slackAt(cut.at);
        auto it = std::ranges::lower_bound(cuts, std::pair(cut.axis, cut.at - reach_m), {}, place);
        for (; it != cuts.end() && it->axis == cut.axis && it->at <= cut.at + reach_m; ++it) {
            const float from = std::max(it->from, low), to = std::min(it->to, high);
            if (std::abs(it->at - cut.at) >= same_line_m || from >= to) continue;
            whole += to - from;
            first = std::min(first, from);
            last = std::max(last, to);
        }
        return wall_share_min * (last - first) < whole ? whole : std::min(cut.to, high) - std::max(cut.from, low);
    }

    // Those on lines through a rectangle, all of each line.
    static std::vector<WallLine> cutsThrough(const std::vector<WallLine>& cuts, glm::vec2 low, glm::vec2 high) {
        std::vector<WallLine> found;
        std::ranges::copy_if(cuts, std::back_inserter(found),
                             [&](const WallLine& c) { return c.at >= low[c.axis] && c.at <= high[c.axis]; });
        return found;
    }

    // What is left of a chart beside the walls so far, and the walls that may stand on it.
    struct Part {
        std::vector<Piece> pieces;
        std::vector<WallLine> cuts;
        glm::vec2 low{1e30f}, high{-1e30f};
        Part(std::vector<Piece> of, const std::vector<WallLine>& all_cuts) : pieces(std::move(of)) {
            for (const Piece& p : pieces)
                for (glm::vec2 c : p.corners) low = glm::min(low, c), high = glm::max(high, c);
            cuts = cutsThrough(all_cuts, low, high);
        }
    };

    static std::optional<WallLine> longestWall(const Part& part, float texels_per_metre) {
        const auto& [pieces, cuts, low, high] = part;
        const float largest = std::max({-low.x, -low.y, high.x, high.y});
        const float margin = std::max(wall_margin_m, rounding_share * largest);
        std::optional<WallLine> best;
        float best_length = 0;
        for (const WallLine& c : cuts) {
            const int along = 1 - c.axis;
            if (c.at < low[c.axis] + margin || c.at > high[c.axis] - margin) continue;
            const float length = wallLength(c, cuts, low[along], high[along]);
            const float needed = std::min(length_min_texels / texels_per_metre, 0.5f * (high[along] - low[along]));
            if (length < needed || length <= best_length) continue;
            best = c;
            best_length = length;
        }
        return best;
    }

    // The longest wall first; the others go on in the halves that they stand in. No recursion: a row of equal walls is
    // as deep as it is long.
    static std::vector<std::vector<Piece>> split(std::vector<Piece> pieces, const std::vector<WallLine>& cuts,
                                                 float texels_per_metre) {
        std::vector<std::vector<Piece>> done;
        std::vector<Part> open;
        open.emplace_back(std::move(pieces), cuts);
        while (!open.empty()) {
            Part part = std::move(open.back());
            open.pop_back();
            const auto wall = longestWall(part, texels_per_metre);
            if (!wall) {
                done.push_back(std::move(part.pieces));
                continue;
            }
            for (float sign : {1.0f, -1.0f}) {
                std::vector<Piece> side;
                for (const Piece& p : part.pieces) {
                    Piece half{p.face, clipped(p.corners, wall->axis, wall->at, sign)};
                    if (half.corners.size() >= 3 && polygonArea(half.corners) > 1e-8f) side.push_back(std::move(half));
                }
                if (!side.empty()) open.emplace_back(std::move(side), part.cuts);
            }
        }
        return done;
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
                regions.push_back(regionOf(mesh, t));
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

    static uint32_t addVertex(SceneMesh& mesh, glm::uvec3 index, const PlanarChart& chart, glm::vec2 p) {
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
        mesh.normals.push_back(glm::normalize(blend(mesh.normals)));
        if (!mesh.uv0.empty()) mesh.uv0.push_back(blend(mesh.uv0));
        return static_cast<uint32_t>(mesh.positions_m.size() - 1);
    }

    Scene& scene_;
    std::vector<PlanarFace> faces_;
    std::vector<Source> sources_;
    // The first faces are those of meshes without an unwrap, the next of those with one; the others have no lightmap.
    size_t cuttable_ = 0, lightmapped_ = 0;
    StandingWalls walls_;
    uint32_t last_region_ = 0;  // that an earlier cut made
};

}  // namespace

void cutAtWalls(Scene& scene, float texels_per_metre) {
    dropInvalidUnwraps(scene);
    // Along each plane's own axes, as most levels are built, and then along those of what is turned against them.
    for (const Along along : {Along::Plane, Along::Edges}) WallCutter(scene, texels_per_metre).run(along);
}

}  // namespace dimmer::cook
