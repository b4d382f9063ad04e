#include <charts/padding.h>

#include <charts/planar.h>
#include <charts/raster.h>
#include <charts/smooth_seams.h>
#include <pack/pack_data.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtx/quaternion.hpp>

namespace dimmer::cook {
namespace {

// Bilinear filtering needs one ring around what is lit. Deeper inside solids nobody looks: it stays black there.
constexpr int fill_rings = 1;
// A neighbour's surface is looked for within this distance of the plane.
constexpr float same_plane_m = 2e-3f;
constexpr float same_direction = 0.999f;
// Of a surface that curves: within so many texels of the plane that is continued from its edge.
constexpr float bend_max = 0.25f;
// And beyond an edge that is shaded as none.
constexpr float seam_bend_max = 0.6f;

bool sameToTheEye(const TangentFrame& a, const TangentFrame& b) {
    return glm::dot(a.normal, b.normal) >= same_direction && glm::dot(a.tangent, b.tangent) >= same_direction &&
           glm::dot(a.bitangent, b.bitangent) >= same_direction;
}

// As the frame lies where its surface is bent back into the plane of another one.
TangentFrame unbent(const TangentFrame& frame, glm::vec3 normal) {
    const glm::quat turn = glm::rotation(frame.normal, normal);
    return {turn * frame.tangent, turn * frame.bitangent, normal};
}

class Padding {
   public:
    Padding(const RayScene& rays, const Unwrap& unwrap, const std::vector<uint8_t>& covered, Texels& texels)
        : rays_(rays), unwrap_(unwrap), covered_(covered), texels_(texels), smooth_(rays, unwrap) {}

    void fill() {
        std::vector<uint32_t> chart_of_fill;
        for (uint32_t c = 0; c < unwrap_.charts.size(); ++c) {
            growRings(unwrap_.charts[c]);
            chart_of_fill.resize(texels_.fills.size(), c);
        }
        std::vector<uint32_t> sources(texels_.fills.size());
        tbb::parallel_for(size_t{0}, texels_.fills.size(), [&](size_t i) {
            const uint32_t beyond = acrossSeam(texels_.fills[i], chart_of_fill[i]);
            sources[i] = beyond != no_index ? beyond : texels_.fills[i].source;
        });
        for (size_t i = 0; i < sources.size(); ++i) texels_.fills[i].source = sources[i];
    }

   private:
    size_t index(uint32_t page, uint32_t x, uint32_t y) const { return unwrap_.texelIndex(page, x, y); }

    bool touchesCovered(const Chart& c, uint32_t x, uint32_t y) const {
        for (uint32_t ny = std::max(y, c.y + 1) - 1; ny <= std::min(y + 1, c.y + c.height - 1); ++ny)
            for (uint32_t nx = std::max(x, c.x + 1) - 1; nx <= std::min(x + 1, c.x + c.width - 1); ++nx)
                if (covered_[index(c.page, nx, ny)]) return true;
        return false;
    }

    void growRings(const Chart& c) {
        using Steps = std::array<std::array<int, 2>, 4>;
        // What lies beside a texel comes before what lies across its corner, from whichever texel it is asked for.
        constexpr std::array<Steps, 2> passes = {
            {{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}}, {{{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}}}};
        std::vector<std::array<uint32_t, 2>> front, next;
        for (uint32_t y = c.y; y < c.y + c.height; ++y)
            for (uint32_t x = c.x; x < c.x + c.width; ++x)
                if (texels_.receiver_at[index(c.page, x, y)] != no_index) front.push_back({x, y});
        for (int ring = 1; !front.empty(); ++ring) {
            next.clear();
            for (const Steps& steps : passes)
                for (auto [x, y] : front)
                    for (auto [dx, dy] : steps) {
                        const auto nx = static_cast<uint32_t>(static_cast<int>(x) + dx);
                        const auto ny = static_cast<uint32_t>(static_cast<int>(y) + dy);
                        if (nx - c.x >= c.width || ny - c.y >= c.height) continue;
                        uint32_t& receiver = texels_.receiver_at[index(c.page, nx, ny)];
                        if (receiver != no_index) continue;
                        receiver = texels_.receiver_at[index(c.page, x, y)];
                        next.push_back({nx, ny});
                        if (ring <= fill_rings && touchesCovered(c, nx, ny))
                            texels_.fills.push_back({TexelAddress::pack(c.page, nx, ny), receiver});
                    }
            front.swap(next);
        }
    }

    // The receiver of another chart of the same surface that lies under the fill's centre; no_index when there is none.
    uint32_t acrossSeam(const FillTexel& fill, uint32_t chart) const {
        const uint32_t own_face = texels_.face(fill.source);
        const TangentFrame& frame = unwrap_.frames[own_face];
        const float texel_m = std::sqrt(unwrap_.texel_area_m2[own_face]);
        const bool curved = unwrap_.charts[chart].curved;
        const uint32_t found = below(fill, chart, curved ? bend_max * texel_m : same_plane_m, [&](uint32_t face) {
            const TangentFrame& other = unwrap_.frames[face];
            return curved ? sameFrame(other, frame) : sameToTheEye(other, frame);
        });
        if (found != no_index || !smooth_.any(chart)) return found;
        return below(fill, chart, seam_bend_max * texel_m, [&](uint32_t face) {
            return smooth_.meet(chart, unwrap_.face_chart[face]) &&
                   sameFrame(unbent(unwrap_.frames[face], frame.normal), frame);
        });
    }

    // Within so many metres of the plane that its source's face is in, on a face of another chart that is as wanted.
    uint32_t below(const FillTexel& fill, uint32_t chart, float off_plane_m, auto&& wanted) const {
        const SamplePoint own = samplePoint(rays_, unwrap_, texels_, fill.source, 0);
        const glm::vec3 normal = unwrap_.frames[own.face].normal;
        const glm::vec3 centre =
            positionAt(own.face, glm::vec2(TexelAddress::x(fill.address) + 0.5f, TexelAddress::y(fill.address) + 0.5f));
        const auto hit = rays_.nearest(centre + normal * off_plane_m, -normal, 2 * off_plane_m, 0);
        if (!hit || hit->back != unwrap_.faces[own.face].back) return no_index;
        // A leaf flush with its wall is gone when the door opens, and its light with it.
        const auto conditionOf = [&](uint32_t triangle) { return rays_.triangles()[triangle].condition; };
        if (conditionOf(hit->triangle) != conditionOf(unwrap_.faces[own.face].triangle)) return no_index;
        const uint32_t face = unwrap_.faceOf(hit->triangle, hit->back);
        if (face == no_index || unwrap_.face_chart[face] == chart || !wanted(face)) return no_index;
        const uint32_t found = receiverOf(unwrap_, texels_, *hit);
        return found == no_index || found == fill.source || parted(own, found) ? no_index : found;
    }

    // By a wall. Over what is round as high as the way along it is long, half of it: clear of its crest.
    bool parted(const SamplePoint& own, uint32_t receiver) const {
        const SamplePoint other = samplePoint(rays_, unwrap_, texels_, receiver, 0);
        const glm::vec3 normal = unwrap_.frames[own.face].normal, other_normal = unwrap_.frames[other.face].normal;
        const bool flat = glm::dot(normal, other_normal) > same_direction;
        const float round_m = std::max(leaf_probe_low_m, 0.5f * glm::length(other.position_m - own.position_m));
        for (const float height_m : {flat ? wall_probe_low_m : round_m, flat ? leaf_probe_low_m : round_m}) {
            const glm::vec3 from = own.position_m + normal * height_m,
                            to = other.position_m + (flat ? normal : other_normal) * height_m;
            if (rays_.blocked(from, to) || rays_.blocked(to, from)) return true;
        }
        return false;
    }

    // The plane of a face, continued to any place of the page.
    glm::vec3 positionAt(uint32_t face, glm::vec2 uv_texels) const {
        const auto& t = unwrap_.uv_texels[face];
        const float area = cross2d(t[1] - t[0], t[2] - t[0]);
        const float u = cross2d(uv_texels - t[0], t[2] - t[0]) / area,
                    v = cross2d(t[1] - t[0], uv_texels - t[0]) / area;
        return rays_.pointOn(unwrap_.faces[face].triangle, u, v);
    }

    const RayScene& rays_;
    const Unwrap& unwrap_;
    const std::vector<uint8_t>& covered_;
    Texels& texels_;
    SmoothSeams smooth_;
};

}  // namespace

void fillPadding(const RayScene& rays, const Unwrap& unwrap, const std::vector<uint8_t>& covered, Texels& texels) {
    Padding(rays, unwrap, covered, texels).fill();
}

}  // namespace dimmer::cook
