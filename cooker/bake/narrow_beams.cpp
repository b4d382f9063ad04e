#include <bake/narrow_beams.h>

#include <bake/punctual.h>
#include <bake/sampling.h>
#include <bake/texel_pieces.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

namespace dimmer::cook {
namespace {

constexpr float narrow_widths = 1.5f;       // of a texel, from the beam's axis to its edge
constexpr uint32_t beam_directions = 1024;  // over the cone: some 150 for each texel of the widest

// Where a ray meets the front of a piece.
std::optional<glm::dvec3> landing(const TexelPiece& piece, glm::dvec3 from, glm::dvec3 direction) {
    const double facing = glm::dot(piece.normal, direction);
    if (!(facing < 0) || piece.corners_m.size() < 3) return std::nullopt;
    const double distance_m = glm::dot(piece.normal, piece.corners_m[0] - from) / facing;
    if (!(distance_m > 0)) return std::nullopt;
    const glm::dvec3 p = from + distance_m * direction;
    bool before = false, behind = false;  // of any edge
    for (size_t i = 0; i < piece.corners_m.size(); ++i) {
        const glm::dvec3 a = piece.corners_m[i], b = piece.corners_m[(i + 1) % piece.corners_m.size()];
        const double side = glm::dot(glm::cross(b - a, p - a), piece.normal);
        before |= side > 0, behind |= side < 0;
    }
    if (before && behind) return std::nullopt;
    return p;
}

struct Landed {
    SamplePoint point;
    float share;  // of the light's intensity
};

// Directions spread over the cone, the same for all texels, any first ones of them as evenly as all.
std::vector<Landed> landedIn(const TexelPieces& pieces, const PunctualLight& light) {
    glm::vec3 u, v;
    orthonormalBasis(light.direction, u, v);
    PunctualLight one = light;
    one.intensity = glm::vec3(1);
    std::vector<Landed> landed;
    for (uint32_t i = 0; i < beam_directions; ++i) {
        const glm::vec2 square = sequence2d(i, 0);
        const float along = 1 - square.x * (1 - light.cone_outer_cos), across = std::sqrt(1 - along * along),
                    angle = 2 * pi * square.y;
        const glm::dvec3 direction(along * light.direction + across * (std::cos(angle) * u + std::sin(angle) * v));
        for (const TexelPiece& piece : pieces.pieces()) {
            const auto p = landing(piece, glm::dvec3(light.position_m), direction);
            if (!p) continue;
            const glm::vec3 on_surface(*p);
            const Illumination lit = illuminate(one, on_surface);
            const float distance_m = std::max(lit.distance_m, lamp_distance_min_m);
            const float share = lit.irradiance_lux.x * distance_m * distance_m;
            const glm::vec3 lifted = on_surface + glm::vec3(piece.normal) * liftOff(on_surface, lamp_lift_m);
            if (share > 0) landed.push_back({{lifted, piece.face}, share});
            break;
        }
    }
    return landed;
}

}  // namespace

std::optional<std::vector<BeamPlace>> narrowBeam(const Gatherer& gatherer, const GatherFrom& from,
                                                 const PunctualLight& light) {
    if (light.type != LightType::Spot || from.texel == no_index || !(light.cone_outer_cos > 0)) return std::nullopt;
    const float width_m = std::sqrt(gatherer.texels().area_m2[from.texel]);
    const glm::vec3 to_texel = from.points[0].position_m - light.position_m;
    const float along_m = glm::dot(to_texel, light.direction);
    const float radius_m = along_m * std::sqrt(1 - light.cone_outer_cos * light.cone_outer_cos) / light.cone_outer_cos;
    if (radius_m > narrow_widths * width_m) return std::nullopt;
    // Past all of a texel of any slant that is lit at all, or behind the lamp.
    const float off_axis_m = glm::length(to_texel - along_m * light.direction);
    const float reach_m = 2 * narrow_widths * width_m;
    if (off_axis_m > radius_m + reach_m || along_m < -reach_m) return std::vector<BeamPlace>{};
    const TexelPieces pieces(gatherer, from);
    if (!(pieces.areaM2() > 0)) return std::nullopt;
    const std::vector<Landed> landed = landedIn(pieces, light);
    const auto share = [](std::span<const Landed> some) {
        return std::accumulate(some.begin(), some.end(), 0.0f,
                               [](float sum, const Landed& l) { return sum + l.share; });
    };
    const auto used = std::span(landed).first(std::min(landed.size(), from.points.size()));
    const float solid_angle_sr = 2 * pi * (1 - light.cone_outer_cos) / beam_directions;
    const float per_share = share(landed) / share(used) * solid_angle_sr / static_cast<float>(pieces.areaM2());
    std::vector<BeamPlace> places;
    for (const Landed& l : used) places.push_back({l.point, light.intensity * (l.share * per_share)});
    return places;
}

}  // namespace dimmer::cook
