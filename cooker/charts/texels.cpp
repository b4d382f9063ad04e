#include <charts/texels.h>

#include <bake/sampling.h>
#include <charts/padding.h>
#include <charts/polygon.h>
#include <charts/raster.h>
#include <pack/pack_data.h>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <glm/gtc/bitfield.hpp>
#include <limits>
#include <optional>
#include <utility>

namespace dimmer::cook {
namespace {

// Rays and shadow rays start this far off the surface (liftOff()): above the rounding of coordinates at 100 m (8e-6 m)
// and the mismatch of coplanar pieces, below any gap that matters.
constexpr float lift_m = 5e-4f;
// What stands between a surface and the point covers it, but for pieces in the surface's plane: about parallel to it,
// and below so much of the lift.
constexpr float in_plane_share = 0.3f, in_plane_cosine = 0.999f;
// How many Halton points are tried before a texel counts as a sliver.
constexpr uint32_t halton_tries = 64;
constexpr uint32_t inside_test_rays = 16;
// With as many backs among them: in a wall, perhaps, over ground that goes on through it.
constexpr uint32_t doubtful_backs_min = 4;
// There is air where ten of the rays along a surface, nearly, get so far without meeting a back.
constexpr uint32_t horizon_rays = 16, horizon_open_min = 10;
constexpr float horizon_sine = 0.1f, horizon_open_m = 1;
// So near behind a door's leaf nobody sees a surface.
constexpr float behind_leaf_m = 0.05f;
// A texel whose first points all lie inside geometry is given up.
constexpr uint32_t drops_max = 24;
constexpr float steps_per_texel = TexelPoint::steps;
// Receivers within such a cell stand in the order of their page; a level has at most so many along an axis.
constexpr float cell_m = 1, cells_max = (1 << 21) - 1;

// A face that ends where a texel does reaches into the next by rounding. Where that is all, what pads the chart is
// better than light at the face's very edge.
constexpr float rounded_share = 1e-3f;

struct Covered {
    uint64_t texel;  // index over all pages
    uint32_t face;
    auto operator<=>(const Covered&) const = default;
};

std::vector<Covered> coverConservatively(const Unwrap& unwrap) {
    std::vector<std::vector<Covered>> parts(unwrap.faces.size());
    tbb::parallel_for(size_t{0}, unwrap.faces.size(), [&](size_t face) {
        const auto& uv = unwrap.uv_texels[face];
        const uint64_t page = uint64_t{unwrap.charts[unwrap.face_chart[face]].page} * unwrap.page_height;
        std::vector<float> areas;
        forEachCellNear(uv, {unwrap.page_width, unwrap.page_height}, [&](uint32_t x, uint32_t y) {
            const float area = polygonArea(clipToCell(uv, x, y));
            if (!(area > 1e-6f)) return;
            parts[face].push_back({(page + y) * unwrap.page_width + x, static_cast<uint32_t>(face)});
            areas.push_back(area);
        });
        const float least = areas.empty() ? 0 : rounded_share * std::ranges::max(areas);
        size_t i = 0;
        std::erase_if(parts[face], [&](const Covered&) { return areas[i++] < least; });
    });
    std::vector<Covered> all;
    for (auto& part : parts) all.insert(all.end(), part.begin(), part.end());
    std::ranges::sort(all);
    return all;
}

// Halton points of the unit square, shifted so that the first `count`, which a whole texel takes, have their centre of
// gravity in the middle: light that changes evenly across a texel is then right at its centre, where it is looked up.
std::vector<glm::u16vec2> centredHalton(uint32_t count) {
    std::vector<glm::vec2> points;
    glm::vec2 sum(0);
    for (uint32_t i = 0; i < std::max(halton_tries, count); ++i) {
        points.emplace_back(radicalInverse(2, i), radicalInverse(3, i));
        if (i < count) sum += points.back();
    }
    std::vector<glm::u16vec2> steps;
    for (const glm::vec2 p : points) {
        const glm::vec2 within = glm::fract(p + 0.5f - sum / static_cast<float>(count));
        // None on the texel's edge: where a wall's skin cuts a chart the edge is in the skin, of neither side.
        constexpr float off_edge = steps_per_texel / 256;
        steps.emplace_back(glm::clamp(glm::round(within * steps_per_texel), off_edge, steps_per_texel - off_edge));
    }
    return steps;
}

glm::vec2 placeIn(glm::uvec2 texel, glm::u16vec2 within) {
    return glm::vec2(texel) + glm::vec2(within) / steps_per_texel;
}

// Barycentric, of a place on a face of the page or just beside it.
glm::vec2 weightsAt(const Unwrap& unwrap, uint32_t face, glm::vec2 place) {
    const auto& t = unwrap.uv_texels[face];
    const float area = cross2d(t[1] - t[0], t[2] - t[0]);
    const glm::vec2 w(cross2d(place - t[0], t[2] - t[0]) / area, cross2d(t[1] - t[0], place - t[0]) / area);
    return glm::clamp(w, glm::vec2(0), glm::vec2(1));
}

SamplePoint pointAt(const RayScene& rays, const Unwrap& unwrap, uint32_t face, glm::vec2 place) {
    const glm::vec2 weights = weightsAt(unwrap, face, place);
    const glm::vec3 on_surface = rays.pointOn(unwrap.faces[face].triangle, weights.x, weights.y);
    return {on_surface + unwrap.frames[face].normal * liftOff(on_surface, lift_m), face};
}

class TexelSampler {
   public:
    TexelSampler(const RayScene& rays, const Unwrap& unwrap, uint32_t samples_max)
        : rays_(rays), unwrap_(unwrap), samples_max_(samples_max), tries_(centredHalton(samples_max)) {}

    struct Result {
        std::vector<TexelPoint> points;
        glm::vec3 place_m{0};  // of the first point
        float area_m2 = 0;
        glm::vec3 reflectance{0};
    };

    Result sample(std::span<const Covered> faces) const {
        Result result;
        const uint64_t texel = faces[0].texel;
        const auto x = static_cast<uint32_t>(texel % unwrap_.page_width);
        const auto y = static_cast<uint32_t>(texel / unwrap_.page_width % unwrap_.page_height);
        const glm::uvec2 corner(x, y);
        Usable usable;
        for (const glm::u16vec2 within : tries_) {
            if (result.points.size() >= samples_max_) break;
            if (result.points.empty() && usable.dropped + usable.behindLeaves() >= drops_max) break;
            if (const auto at = surfaceAt(faces, corner, within)) tryPoint(corner, *at, usable, result);
        }
        float largest = 0;
        TexelPoint centroid;
        for (const Covered& c : faces) {
            const auto polygon = clipToCell(unwrap_.uv_texels[c.face], x, y);
            const float area = polygonArea(polygon);
            result.area_m2 += area * unwrap_.texel_area_m2[c.face];
            if (area <= largest) continue;
            largest = area;
            const glm::vec2 within = (mean(polygon) - glm::vec2(corner)) * steps_per_texel;
            const glm::u16vec2 steps(glm::clamp(within, 0.0f, steps_per_texel - 1));
            centroid = {c.face, steps.x, steps.y};
        }
        if (usable.tried == 0 && largest > 0) tryPoint(corner, centroid, usable, result);
        if (usable.dropped > result.points.size() + usable.behindLeaves())
            std::erase_if(result.points, [&](const TexelPoint& p) {
                return std::ranges::find(usable.doubtful, p) != usable.doubtful.end();
            });
        // All of it lies behind doors' leaves, or in one: what is seen while they are closed, while they are open, or
        // what the door's other state uncovers.
        for (auto* points : {&usable.behind_open, &usable.behind_closed, &usable.behind_both, &usable.in_leaf})
            if (result.points.empty()) result.points = std::move(*points);
        if (result.points.size() > samples_max_) result.points.resize(samples_max_);
        // Few points may all lie in holes of what rays do hit.
        if (usable.tried > 0 && usable.alpha == 0)
            for (const glm::u16vec2 within : tries_)
                if (const auto at = surfaceAt(faces, corner, within)) addReflectance(corner, *at, usable, result);
        if (usable.alpha > 0) result.reflectance /= usable.alpha;
        if ((usable.dropped > 0 || !usable.doubtful.empty()) && result.points.size() > 1)
            keepOneSideOfWalls(corner, result.points);
        if (!result.points.empty()) result.place_m = positionM(corner, result.points[0]);
        return result;
    }

   private:
    static glm::vec2 mean(const std::vector<glm::vec2>& polygon) {
        glm::vec2 sum(0);
        for (glm::vec2 p : polygon) sum += p;
        return sum / static_cast<float>(polygon.size());
    }

    glm::vec3 positionM(glm::uvec2 texel, const TexelPoint& p) const {
        return pointAt(rays_, unwrap_, p.face, placeIn(texel, {p.x, p.y})).position_m;
    }

    std::optional<TexelPoint> surfaceAt(std::span<const Covered> faces, glm::uvec2 texel, glm::u16vec2 within) const {
        for (const Covered& c : faces)
            if (barycentric(unwrap_.uv_texels[c.face], placeIn(texel, within)))
                return TexelPoint{c.face, within.x, within.y};
        return std::nullopt;
    }

    struct Usable {
        uint32_t tried = 0, dropped = 0;
        float alpha = 0;                   // sum over what the reflectance was added up over
        std::vector<TexelPoint> in_leaf;   // of the dropped ones
        std::vector<TexelPoint> doubtful;  // of the others: where most are dropped they are, too
        // Of the others, close behind a leaf as it stands closed, or open: they count where a texel has no better.
        std::vector<TexelPoint> behind_closed, behind_open, behind_both;
        size_t behindLeaves() const { return behind_closed.size() + behind_open.size() + behind_both.size(); }
    };

    // Of what is solid.
    enum class Side { Out, Doubtful, In };

    void tryPoint(glm::uvec2 texel, const TexelPoint& p, Usable& usable, Result& result) const {
        const uint32_t triangle = unwrap_.faces[p.face].triangle;
        const glm::vec3 position = positionM(texel, p);
        addReflectance(texel, p, usable, result);
        ++usable.tried;
        const auto nearest = [&](glm::vec3 direction) { return rays_.nearest(position, direction, far_away_m, 0); };
        const Side side =
            isCovered(p, position, Surfaces::All) ? Side::In : sideOf({position, p.face}, Surfaces::All, nearest);
        if (side == Side::Doubtful) usable.doubtful.push_back(p);
        if (side != Side::In) {
            const auto [closed, open] = behindLeaf(p, position);
            (closed ? open ? usable.behind_both : usable.behind_closed
             : open ? usable.behind_open
                    : result.points)
                .push_back(p);
            return;
        }
        ++usable.dropped;
        const auto stays = [&](glm::vec3 direction) { return nearestWithout(triangle, position, direction); };
        if (rays_.anyLeaf() && usable.in_leaf.size() < samples_max_ && !isCovered(p, position, Surfaces::Walls) &&
            sideOf({position, p.face}, Surfaces::Walls, stays) != Side::In)
            usable.in_leaf.push_back(p);
    }

    // Where two surfaces meet at an acute angle, as floor and roof at eaves do, a point lifted off the one is beyond
    // the other, in whatever light is there.
    bool isCovered(const TexelPoint& p, glm::vec3 position, Surfaces surfaces) const {
        const glm::vec3 normal = unwrap_.frames[p.face].normal;
        const float way_m = liftOff(position, lift_m) - liftOff(position, 0);
        const auto hit = rays_.nearest(position, -normal, way_m, 0, surfaces);
        if (!hit || rays_.alphaAt(hit->triangle, hit->u, hit->v) < 1) return false;
        const float cosine = glm::dot(normal, rays_.triangles()[hit->triangle].normal);
        return hit->distance_m < (1 - in_plane_share) * way_m || std::abs(cosine) < in_plane_cosine;
    }

    // Of one that stands closed, and of one that stands open. The gap behind a leaf that hangs in front of its opening
    // is as bright as the room beyond: beside the leaf a texel would show that all along its edge.
    std::pair<bool, bool> behindLeaf(const TexelPoint& p, glm::vec3 position) const {
        std::pair<bool, bool> behind{false, false};
        const bool of_leaf = rays_.triangles()[unwrap_.faces[p.face].triangle].condition != no_condition;
        if (!rays_.anyLeaf() || of_leaf) return behind;
        LeafHits leaves;
        rays_.nearest(position, unwrap_.frames[p.face].normal, behind_leaf_m, 0, Surfaces::Walls, no_model, &leaves);
        for (const Hit& hit : leaves)
            (rays_.triangles()[hit.triangle].condition % 2 == 0 ? behind.first : behind.second) = true;
        return behind;
    }

    // Light that hits a texel hits it where it is not cut out: colours count by how much of it they stop.
    void addReflectance(glm::uvec2 texel, const TexelPoint& p, Usable& usable, Result& result) const {
        const uint32_t triangle = unwrap_.faces[p.face].triangle;
        const glm::vec2 weights = weightsAt(unwrap_, p.face, placeIn(texel, {p.x, p.y}));
        const float alpha = rays_.alphaAt(triangle, weights.x, weights.y);
        const glm::vec4 color = rays_.surfaceColor(triangle, weights.x, weights.y);
        result.reflectance +=
            alpha * rays_.scene().materials[rays_.triangles()[triangle].material].reflectance(glm::vec3(color));
        usable.alpha += alpha;
    }

    // Without the leaves of doors, but for one that the triangle itself is of.
    std::optional<Hit> nearestWithout(uint32_t triangle, glm::vec3 position, glm::vec3 direction) const {
        const uint32_t own = rays_.triangles()[triangle].condition;
        LeafHits leaves;
        const auto wall = rays_.nearest(position, direction, far_away_m, 0, Surfaces::Walls, no_model,
                                        own != no_condition ? &leaves : nullptr);
        for (const Hit& hit : leaves)
            if (rays_.triangles()[hit.triangle].condition == own) return hit;
        return wall;
    }

    // A point in a closed solid sees its back faces wherever it looks. A few rays decide the common case that it sees
    // none. Where solids touch, the one's back and the other's front are in one place, as where rooms without walls'
    // thickness do: that tells neither, and where most is so, rays along the surface tell more.
    Side sideOf(const SamplePoint& at, Surfaces surfaces, auto&& nearest) const {
        const TangentFrame& f = unwrap_.frames[at.face];
        uint32_t backs = 0, told = 0;
        const auto look = [&](glm::vec3 direction) {
            const auto hit = nearest(direction);
            const bool back = hit && hit->back && !isSkin(hit->triangle);
            backs += back;
            told += back || !hit || !rays_.liesOnBack(*hit, at.position_m, direction, surfaces);
        };
        for (uint32_t i = 0; i < inside_test_rays; ++i) {
            if (i == inside_test_rays / 4 && backs == 0 && told == i) return Side::Out;
            const glm::vec3 d = cosineDirection(sequence2d(i, at.face));
            look(f.tangent * d.x + f.bitangent * d.y + f.normal * d.z);
        }
        if (told < inside_test_rays / 2)
            for (uint32_t i = 0; i < horizon_rays; ++i) look(alongSurface(f, i));
        if (2 * backs > told) return openAround(f, nearest) ? Side::Out : Side::In;
        return backs >= doubtful_backs_min ? Side::Doubtful : Side::Out;
    }

    static glm::vec3 alongSurface(const TangentFrame& f, uint32_t i) {
        const float angle = 2 * pi * static_cast<float>(i) / horizon_rays;
        const glm::vec3 along = std::cos(angle) * f.tangent + std::sin(angle) * f.bitangent;
        return std::sqrt(1 - horizon_sine * horizon_sine) * along + horizon_sine * f.normal;
    }

    // Below a roof of one skin backs are most of what is seen, and air is all around. (Inside a cupboard without its
    // hidden sides the wall behind it is near.)
    bool openAround(const TangentFrame& f, auto&& nearest) const {
        uint32_t open = 0;
        for (uint32_t i = 0; i < horizon_rays && open < horizon_open_min; ++i) {
            const auto hit = nearest(alongSurface(f, i));
            const bool stopped_by_back = hit && hit->back && !isSkin(hit->triangle);
            open += !stopped_by_back && !(hit && hit->distance_m < horizon_open_m);
        }
        return open >= horizon_open_min;
    }

    // Nothing is inside behind its back: it has none, or lets light by.
    bool isSkin(uint32_t triangle) const {
        const Material& material = rays_.scene().materials[rays_.triangles()[triangle].material];
        return material.double_sided || material.alpha_mode != AlphaMode::Opaque;
    }

    // Part of the texel lies inside a wall: of the parts on its two sides, the one with more points stays.
    void keepOneSideOfWalls(glm::uvec2 texel, std::vector<TexelPoint>& points) const {
        size_t best = 0, best_count = 0;
        std::vector<glm::vec3> places_m;
        for (const TexelPoint& p : points) places_m.push_back(positionM(texel, p));
        std::vector<std::vector<TexelPoint>> seen(points.size());
        for (size_t a = 0; a < points.size(); ++a) {
            for (size_t b = 0; b < points.size(); ++b)
                if (a == b || !rays_.blocked(places_m[a], places_m[b])) seen[a].push_back(points[b]);
            if (seen[a].size() > best_count) best_count = seen[a].size(), best = a;
        }
        points = seen[best];
    }

    const RayScene& rays_;
    const Unwrap& unwrap_;
    uint32_t samples_max_;
    std::vector<glm::u16vec2> tries_;
};

// The texels that have points, along a curve through space (Morton 1966). Pages put a room's charts far from each
// other; this way what rays of neighbours read is near by in memory, and so are its numbers.
std::vector<uint32_t> bySpace(std::span<const TexelSampler::Result> texels) {
    glm::vec3 low(std::numeric_limits<float>::max());
    for (const auto& t : texels)
        if (!t.points.empty()) low = glm::min(low, t.place_m);
    std::vector<std::pair<uint64_t, uint32_t>> order;
    for (uint32_t i = 0; i < texels.size(); ++i) {
        if (texels[i].points.empty()) continue;
        const glm::uvec3 cell(glm::min((texels[i].place_m - low) / cell_m, cells_max));
        order.emplace_back(glm::bitfieldInterleave(cell.x, cell.y, cell.z), i);
    }
    std::ranges::sort(order);
    std::vector<uint32_t> sorted;
    for (const auto& [place, i] : order) sorted.push_back(i);
    return sorted;
}

}  // namespace

Texels sampleTexels(const RayScene& rays, const Unwrap& unwrap, uint32_t samples_max, Progress* progress) {
    const std::vector<Covered> cover = coverConservatively(unwrap);
    std::vector<size_t> starts;
    for (size_t i = 0; i < cover.size(); ++i)
        if (i == 0 || cover[i].texel != cover[i - 1].texel) starts.push_back(i);
    starts.push_back(cover.size());
    const size_t candidates = starts.size() - 1;

    const TexelSampler sampler(rays, unwrap, samples_max);
    std::vector<TexelSampler::Result> results(candidates);
    if (progress) progress->stage("texels", candidates);
    tbb::parallel_for(tbb::blocked_range<size_t>(0, candidates), [&](const auto& range) {
        for (size_t i = range.begin(); i < range.end(); ++i)
            results[i] = sampler.sample({cover.data() + starts[i], starts[i + 1] - starts[i]});
        if (progress) progress->advance(range.size());
    });

    const std::vector<uint32_t> order = bySpace(results);
    Texels out;
    const size_t page_texels = size_t{unwrap.page_count} * unwrap.page_width * unwrap.page_height;
    out.receiver_at.assign(page_texels, no_index);
    std::vector<uint8_t> covered(page_texels);
    for (size_t i = 0; i < candidates; ++i) covered[cover[starts[i]].texel] = 1;
    out.first_sample.push_back(0);
    for (const uint32_t i : order) {
        const uint64_t texel = cover[starts[i]].texel;
        out.receiver_at[texel] = static_cast<uint32_t>(out.address.size());
        out.address.push_back(
            TexelAddress::pack(static_cast<uint32_t>(texel / unwrap.page_width / unwrap.page_height),
                               static_cast<uint32_t>(texel % unwrap.page_width),
                               static_cast<uint32_t>(texel / unwrap.page_width % unwrap.page_height)));
        out.area_m2.push_back(results[i].area_m2);
        out.reflectance.push_back(results[i].reflectance);
        out.samples.insert(out.samples.end(), results[i].points.begin(), results[i].points.end());
        out.first_sample.push_back(static_cast<uint32_t>(out.samples.size()));
    }
    fillPadding(rays, unwrap, covered, out);
    return out;
}

glm::vec2 placeOnPage(const Texels& texels, size_t receiver, uint32_t i) {
    const uint32_t address = texels.address[receiver];
    const TexelPoint& p = texels.sample(receiver, i);
    return placeIn({TexelAddress::x(address), TexelAddress::y(address)}, {p.x, p.y});
}

SamplePoint samplePoint(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, size_t receiver, uint32_t i) {
    return pointAt(rays, unwrap, texels.sample(receiver, i).face, placeOnPage(texels, receiver, i));
}

uint32_t neighbourInChart(const Unwrap& unwrap, const Texels& texels, size_t receiver, int dx, int dy) {
    const uint32_t address = texels.address[receiver];
    const Chart& chart = unwrap.charts[unwrap.face_chart[texels.face(receiver)]];
    const int x = static_cast<int>(TexelAddress::x(address)) + dx, y = static_cast<int>(TexelAddress::y(address)) + dy;
    if (x < static_cast<int>(chart.x) || y < static_cast<int>(chart.y) ||
        x >= static_cast<int>(chart.x + chart.width) || y >= static_cast<int>(chart.y + chart.height))
        return no_index;
    const uint32_t found =
        texels.receiver_at[unwrap.texelIndex(chart.page, static_cast<uint32_t>(x), static_cast<uint32_t>(y))];
    // Copies of a receiver (padding) do not count twice.
    const bool own =
        found != no_index &&
        texels.address[found] == TexelAddress::pack(chart.page, static_cast<uint32_t>(x), static_cast<uint32_t>(y));
    return own ? found : no_index;
}

uint32_t receiverOf(const Unwrap& unwrap, const Texels& texels, const Hit& hit) {
    const uint32_t face = unwrap.faceOf(hit.triangle, hit.back);
    if (face == no_index) return no_index;
    const auto& uv = unwrap.uv_texels[face];
    const Chart& c = unwrap.charts[unwrap.face_chart[face]];
    const glm::vec2 p = (1 - hit.u - hit.v) * uv[0] + hit.u * uv[1] + hit.v * uv[2];
    const auto x = std::clamp(static_cast<uint32_t>(std::max(p.x, 0.0f)), c.x, c.x + c.width - 1);
    const auto y = std::clamp(static_cast<uint32_t>(std::max(p.y, 0.0f)), c.y, c.y + c.height - 1);
    return texels.receiver_at[unwrap.texelIndex(c.page, x, y)];
}

}  // namespace dimmer::cook
