#include <charts/wall_cuts.h>

#include <charts/box_tree.h>
#include <charts/file_uv.h>
#include <charts/planar.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <tuple>

namespace dimmer::cook {
namespace {

constexpr float same_line_m = 2e-3f;
constexpr float reach_texels = 2.5f;     // thinner than this leaks: bilinear filtering plus half a texel of averaging
constexpr float length_min_texels = 3;   // of all stretches between doorways; a table's leg is no wall
constexpr float wall_share_min = 0.25f;  // of a wall with its doorways
constexpr float margin_m = 5e-3f;  // a cut this close to a rectangle's edge parts nothing, nor one within its rounding
constexpr float doorway_min_m = 0.5f;  // narrower ones are gaps between a shelf's boards
constexpr float facing_cos = 0.99f, facing_share = 0.9f, probe_share_of_room = 0.9f;
constexpr float rounding_share = 1e-5f;  // of the largest coordinate: far above what a few dot products lose

// The trace of a blocking triangle on a plane: an interval of a line x = at (axis 0) or y = at (axis 1).
struct Trace {
    int axis;
    float at, from, to;
    bool forward;  // its front looks towards larger coordinates
};

struct Cut {
    int axis = 0;
    float at = 0, from = 0, to = 0;
};

// A convex piece of a level triangle in its chart's plane.
struct Piece {
    uint32_t face;
    std::vector<glm::vec2> corners;
};

struct Source {
    uint32_t mesh, triangle;
};

float area(const std::vector<glm::vec2>& p) {
    float twice = 0;
    for (size_t i = 2; i < p.size(); ++i) {
        const glm::vec2 a = p[i - 1] - p[0], b = p[i] - p[0];
        twice += a.x * b.y - a.y * b.x;
    }
    return 0.5f * std::abs(twice);
}

// The part of a convex polygon on one side of a line.
std::vector<glm::vec2> clip(const std::vector<glm::vec2>& polygon, const Cut& cut, float sign) {
    std::vector<glm::vec2> out;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const glm::vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
        const float da = sign * (a[cut.axis] - cut.at), db = sign * (b[cut.axis] - cut.at);
        if (da >= 0) out.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            glm::vec2 p = a + (b - a) * (da / (da - db));
            p[cut.axis] = cut.at;
            out.push_back(p);
        }
    }
    return out;
}

class WallCutter {
   public:
    WallCutter(Scene& scene, float texels_per_metre) : scene_(scene) {
        addFaces(false, texels_per_metre);
        cuttable_ = faces_.size();
        addFaces(true, texels_per_metre);
        std::vector<BoxTree::Box> boxes;
        for (const uint32_t f : blocking_) {
            boxes.push_back(BoxTree::boxOf(faces_[f].corners_m));
            largest_m_ = std::max({largest_m_, largest(boxes.back().min_m), largest(boxes.back().max_m)});
        }
        blocking_boxes_ = BoxTree(std::move(boxes));
    }

    // Along::Edges: charts that are turned alone; the others have been cut before.
    void run(Along along) {
        constexpr uint32_t no_side_limit = 1u << 20;
        auto charts = planarCharts(std::span(faces_).first(cuttable_), no_side_limit, {}, along);
        if (along == Along::Edges) std::erase_if(charts, [](const PlanarChart& chart) { return !chart.turned; });
        std::vector<std::vector<std::vector<Piece>>> parts(charts.size());
        tbb::parallel_for(size_t{0}, charts.size(), [&](size_t c) { parts[c] = partsOf(charts[c]); });
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
        for (const auto& [mesh, replacements] : by_mesh) rebuild(scene_.meshes[mesh], replacements);
    }

   private:
    struct Replacement {
        Piece piece;
        uint32_t region;
        const PlanarChart* chart;
    };
    using Replacements = std::map<uint32_t, std::vector<Replacement>>;

    static uint32_t regionOf(const SceneMesh& mesh, uint32_t triangle) {
        return mesh.triangle_regions.empty() ? 0 : mesh.triangle_regions[triangle];
    }

    static float largest(glm::vec3 p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

    void addFaces(bool of_unwraps, float texels_per_metre) {
        for (uint32_t m = 0; m < scene_.meshes.size(); ++m) {
            const SceneMesh& mesh = scene_.meshes[m];
            if (!hasLightmap(mesh) || mesh.uv1.empty() == of_unwraps) continue;
            for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
                std::array<glm::vec3, 3> c;
                for (int i = 0; i < 3; ++i) c[static_cast<size_t>(i)] = mesh.positions_m[mesh.triangles[t][i]];
                const glm::vec3 normal = glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]));
                if (scene_.materials[mesh.triangle_materials[t]].alpha_mode == AlphaMode::Opaque)
                    blocking_.push_back(static_cast<uint32_t>(faces_.size()));
                const uint32_t region = regionOf(mesh, t);
                last_region_ = std::max(last_region_, region);
                faces_.push_back(
                    {c, normal, mesh.texels_per_metre.value_or(texels_per_metre), chartGroup(mesh), region});
                sources_.push_back({m, t});
            }
        }
    }

    std::vector<std::vector<Piece>> partsOf(const PlanarChart& chart) const {
        const std::vector<Cut> cuts = findCuts(chart);
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

    // Where pairs of surfaces, back to back and close together, stand on the chart's plane.
    std::vector<Cut> findCuts(const PlanarChart& chart) const {
        const float reach_m = reach_texels / chart.texels_per_metre;
        const std::vector<Trace> traces =
            standing(findTraces(chart, wall_probe_low_m), findTraces(chart, highProbe(chart)));
        std::vector<Cut> cuts;
        for (const Trace& a : traces) {
            if (a.forward) continue;
            // A solid between a's front, looking back, and b's, looking forward.
            for (const Trace& b : near(traces, a.axis, true, a.at - same_line_m, a.at + reach_m)) {
                if (b.at < a.at - same_line_m || b.at - a.at > reach_m) continue;
                const float from = std::max(a.from, b.from), to = std::min(a.to, b.to);
                if (to - from > same_line_m) cuts.push_back({a.axis, 0.5f * (a.at + b.at), from, to});
            }
        }
        return joinCuts(std::move(cuts));
    }

    // A wall is as high as there is room: between the jambs of a narrow doorway a closed leaf stands from one to the
    // other, and is no higher over either. So below what faces nearly all of the chart, where that is near.
    float highProbe(const PlanarChart& chart) const {
        const PlanarFace& any = faces_[chart.faces[0]];
        if (any.group != 0) return wall_probe_high_m;  // of a door's leaf
        const float plane = glm::dot(any.normal, any.corners_m[0]);
        BoxTree::Box box = boxOver(chart, any.normal, plane);
        const BoxTree::Box above = boxOver(chart, any.normal, plane + wall_probe_high_m);
        box.min_m = glm::min(box.min_m, above.min_m), box.max_m = glm::max(box.max_m, above.max_m);
        std::vector<std::pair<float, float>> facing;  // height, area over the chart's rectangle
        for (const uint32_t near : blocking_boxes_.touching(box)) {
            const PlanarFace& face = faces_[blocking_[near]];
            const float height = glm::dot(any.normal, face.corners_m[0]) - plane;
            const bool moves = face.group != 0;
            if (moves || glm::dot(any.normal, face.normal) > -facing_cos || height < doorway_min_m ||
                height > wall_probe_high_m)
                continue;
            std::vector<glm::vec2> over;
            for (const glm::vec3 p : face.corners_m)
                over.emplace_back(glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis));
            for (int axis = 0; axis < 2; ++axis) {
                over = clip(over, {axis, chart.min_m[axis], 0, 0}, 1);
                over = clip(over, {axis, chart.min_m[axis] + chart.size_m[axis], 0, 0}, -1);
            }
            facing.emplace_back(height, area(over));
        }
        std::ranges::sort(facing);
        float covered = 0;
        for (const auto& [height, area_m2] : facing)
            if ((covered += area_m2) >= facing_share * chart.size_m.x * chart.size_m.y)
                return probe_share_of_room * height;
        return wall_probe_high_m;
    }

    static std::tuple<int, bool, float> placeOf(const Trace& t) { return {t.axis, t.forward, t.at}; }

    // What sums with a coordinate lose to rounding, and more.
    static float slackAt(float at) { return 4 * std::numeric_limits<float>::epsilon() * std::abs(at); }

    // Of traces in the order of placeOf, those between two places and perhaps a few more.
    static std::span<const Trace> near(std::span<const Trace> sorted, int axis, bool forward, float low, float high) {
        const auto first = std::ranges::lower_bound(sorted, std::tuple(axis, forward, low - slackAt(low)), {}, placeOf);
        return {first, std::ranges::upper_bound(first, sorted.end(), std::tuple(axis, forward, high + slackAt(high)),
                                                {}, placeOf)};
    }

    // What is there at both heights.
    static std::vector<Trace> standing(const std::vector<Trace>& low, std::vector<Trace> high) {
        std::ranges::sort(high, {}, placeOf);
        std::vector<Trace> both;
        for (const Trace& a : low)
            for (const Trace& b : near(high, a.axis, a.forward, a.at - same_line_m, a.at + same_line_m)) {
                if (std::abs(a.at - b.at) > same_line_m) continue;
                const Trace t{a.axis, a.at, std::max(a.from, b.from), std::min(a.to, b.to), a.forward};
                if (t.to - t.from > same_line_m) both.push_back(t);
            }
        std::ranges::sort(both, {}, placeOf);
        return both;
    }

    // What holds every trace that counts on the plane dot(normal, p) = height over a chart's rectangle. The normal of
    // one of its faces may differ from the chart's own by a rounding step.
    BoxTree::Box boxOver(const PlanarChart& chart, glm::vec3 normal, float height) const {
        const glm::vec3 up = glm::cross(chart.u_axis, chart.v_axis);
        std::array<glm::vec3, 4> corners;
        for (uint32_t i = 0; i < 4; ++i) {
            const glm::vec2 at = chart.min_m + chart.size_m * glm::vec2(i & 1, i >> 1);
            const glm::vec3 flat = at.x * chart.u_axis + at.y * chart.v_axis;
            corners[i] = flat + up * ((height - glm::dot(normal, flat)) / glm::dot(normal, up));
        }
        BoxTree::Box box = BoxTree::boxOf(corners);
        const float reach_m =
            margin_m + same_line_m + rounding_share * std::max({largest_m_, largest(box.min_m), largest(box.max_m)});
        box.min_m -= reach_m;
        box.max_m += reach_m;
        return box;
    }

    std::vector<Trace> findTraces(const PlanarChart& chart, float height_m) const {
        const PlanarFace& any = faces_[chart.faces[0]];
        const float height = glm::dot(any.normal, any.corners_m[0]) + height_m;
        const glm::vec2 low = chart.min_m, high = chart.min_m + chart.size_m;
        std::vector<Trace> traces;
        for (const uint32_t near : blocking_boxes_.touching(boxOver(chart, any.normal, height))) {
            const uint32_t f = blocking_[near];
            const PlanarFace& face = faces_[f];
            std::array<float, 3> d;
            for (size_t i = 0; i < 3; ++i) d[i] = glm::dot(any.normal, face.corners_m[i]) - height;
            if ((d[0] > 0) == (d[1] > 0) && (d[1] > 0) == (d[2] > 0)) continue;
            std::array<glm::vec2, 2> ends;
            size_t n = 0;
            for (size_t i = 0; i < 3 && n < 2; ++i) {
                const size_t j = (i + 1) % 3;
                if ((d[i] > 0) == (d[j] > 0)) continue;
                const glm::vec3 p = glm::mix(face.corners_m[i], face.corners_m[j], d[i] / (d[i] - d[j]));
                ends[n++] = {glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis)};
            }
            if (n < 2) continue;
            const glm::vec2 normal(glm::dot(face.normal, chart.u_axis), glm::dot(face.normal, chart.v_axis));
            for (int axis = 0; axis < 2; ++axis) {
                if (std::abs(ends[0][axis] - ends[1][axis]) > same_line_m) continue;
                const int along = 1 - axis;
                Trace t{axis, 0.5f * (ends[0][axis] + ends[1][axis]),
                        std::max(low[along], std::min(ends[0][along], ends[1][along])),
                        std::min(high[along], std::max(ends[0][along], ends[1][along])), normal[axis] > 0};
                if (t.to - t.from < same_line_m || t.at < low[axis] - margin_m || t.at > high[axis] + margin_m)
                    continue;
                traces.push_back(t);
                const Source s = sources_[f];
                if (!scene_.materials[scene_.meshes[s.mesh].triangle_materials[s.triangle]].double_sided) continue;
                t.forward = !t.forward;
                traces.push_back(t);
            }
        }
        return traces;
    }

    // Pieces of one wall (its triangles, its faces) become one cut.
    static std::vector<Cut> joinCuts(std::vector<Cut> cuts) {
        std::ranges::sort(cuts, {}, [](const Cut& c) { return std::tuple(c.axis, c.at, c.from, c.to); });
        std::vector<Cut> joined;
        size_t first = 0;  // of those that are on the line of the cuts to come
        for (const Cut& c : cuts) {
            while (first < joined.size() && (joined[first].axis != c.axis || !(c.at - joined[first].at < same_line_m)))
                ++first;
            const auto same = std::find_if(
                joined.begin() + static_cast<std::ptrdiff_t>(first), joined.end(),
                [&](const Cut& o) { return c.from <= o.to + same_line_m && o.from <= c.to + same_line_m; });
            if (same == joined.end()) {
                joined.push_back(c);
                continue;
            }
            same->from = std::min(same->from, c.from);
            same->to = std::max(same->to, c.to);
        }
        return joined;
    }

    // Between two ends, with what goes on beyond doorways: at a few texels per metre no stretch between them is long. A
    // row of pillars, most of which is gap, is none. `cuts` ascend as joinCuts has them.
    static float wallLength(const Cut& cut, const std::vector<Cut>& cuts, float low, float high) {
        float whole = 0, first = high, last = low;
        const auto place = [](const Cut& c) { return std::pair(c.axis, c.at); };
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
    static std::vector<Cut> cutsThrough(const std::vector<Cut>& cuts, glm::vec2 low, glm::vec2 high) {
        std::vector<Cut> found;
        std::ranges::copy_if(cuts, std::back_inserter(found),
                             [&](const Cut& c) { return c.at >= low[c.axis] && c.at <= high[c.axis]; });
        return found;
    }

    // What is left of a chart beside the walls so far, and the walls that may stand on it.
    struct Part {
        std::vector<Piece> pieces;
        std::vector<Cut> cuts;
        glm::vec2 low{1e30f}, high{-1e30f};
        Part(std::vector<Piece> of, const std::vector<Cut>& all_cuts) : pieces(std::move(of)) {
            for (const Piece& p : pieces)
                for (glm::vec2 c : p.corners) low = glm::min(low, c), high = glm::max(high, c);
            cuts = cutsThrough(all_cuts, low, high);
        }
    };

    static std::optional<Cut> longestWall(const Part& part, float texels_per_metre) {
        const auto& [pieces, cuts, low, high] = part;
        const float largest = std::max({-low.x, -low.y, high.x, high.y});
        const float margin = std::max(margin_m, rounding_share * largest);
        std::optional<Cut> best;
        float best_length = 0;
        for (const Cut& c : cuts) {
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
    static std::vector<std::vector<Piece>> split(std::vector<Piece> pieces, const std::vector<Cut>& cuts,
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
                    Piece half{p.face, clip(p.corners, *wall, sign)};
                    if (half.corners.size() >= 3 && area(half.corners) > 1e-8f) side.push_back(std::move(half));
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
    size_t cuttable_ = 0;  // the first so many faces; the others' meshes bring an unwrap, and they only block
    std::vector<uint32_t> blocking_;  // faces, ascending
    BoxTree blocking_boxes_;          // theirs
    float largest_m_ = 0;             // coordinate among theirs
    uint32_t last_region_ = 0;        // that an earlier cut made
};

}  // namespace

void cutAtWalls(Scene& scene, float texels_per_metre) {
    dropInvalidUnwraps(scene);
    // Along each plane's own axes, as most levels are built, and then along those of what is turned against them.
    for (const Along along : {Along::Plane, Along::Edges}) WallCutter(scene, texels_per_metre).run(along);
}

}  // namespace dimmer::cook
