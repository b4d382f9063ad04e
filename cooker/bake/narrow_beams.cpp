#include <bake/narrow_beams.h>

#include <bake/punctual.h>
#include <bake/sampling.h>
#include <bake/texel_pieces.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr float beam_cos_min = 0.7071f;     // wider cones, from 45 degrees on, are no beams
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

// Directions spread over the cone, the same for all texels.
std::vector<BeamPlace> landedIn(const TexelPieces& pieces, const PunctualLight& light, glm::vec3 axis, float cosine) {
    glm::vec3 u, v;
    orthonormalBasis(axis, u, v);
    const float solid_angle_sr = 2 * pi * (1 - cosine) / beam_directions;
    std::vector<BeamPlace> landed;
    for (uint32_t i = 0; i < beam_directions; ++i) {
        const glm::vec3 d = uniformCapDirection(sequence2d(i, 0), cosine);
        const glm::dvec3 direction(u * d.x + v * d.y + axis * d.z);
        for (const TexelPiece& piece : pieces.pieces()) {
            const auto p = landing(piece, glm::dvec3(light.position_m), direction);
            if (!p) continue;
            const glm::vec3 on_surface(*p);
            const Illumination lit = illuminate(light, on_surface);
            const float distance_m = std::max(lit.distance_m, lamp_distance_min_m);
            const glm::vec3 intensity_cd = lit.irradiance_lux * distance_m * distance_m;
            const glm::vec3 lifted = on_surface + glm::vec3(piece.normal) * liftOff(on_surface, lamp_lift_m);
            if (luminance(intensity_cd) > 0)
                landed.push_back(
                    {{lifted, piece.face}, intensity_cd * (solid_angle_sr / static_cast<float>(pieces.areaM2()))});
            break;
        }
    }
    return landed;
}

}  // namespace

std::optional<NarrowBeam> narrowBeam(const Gatherer& gatherer, const GatherFrom& from, const PunctualLight& light) {
    const BeamCones beam = beamCones(light);
    if (from.texel == no_index || beam.cosines.empty()) return std::nullopt;
    const float width_m = std::sqrt(gatherer.texels().area_m2[from.texel]);
    const glm::vec3 to_texel = from.points[0].position_m - light.position_m;
    const float along_m = glm::dot(to_texel, beam.axis);
    const auto radiusM = [&](float cosine) { return along_m * std::sqrt(1 - cosine * cosine) / cosine; };
    const auto isNarrow = [&](float cosine) {
        return cosine >= beam_cos_min && radiusM(cosine) <= narrow_widths * width_m;
    };
    const auto widest = std::find_if(beam.cosines.rbegin(), beam.cosines.rend(), isNarrow);
    if (widest == beam.cosines.rend()) return std::nullopt;
    NarrowBeam found{beam.axis, *widest, {}};
    // Past all of the texel, within which the radius changes by no more than its length; or behind the lamp.
    const float off_axis_m = glm::length(to_texel - along_m * beam.axis);
    const float reach_m = 2 * narrow_widths * width_m;
    if (off_axis_m > radiusM(*widest) + reach_m || along_m < -reach_m) return found;
    const TexelPieces pieces(gatherer, from);
    if (!(pieces.areaM2() > 0)) return std::nullopt;
    found.places = landedIn(pieces, light, beam.axis, *widest);
    return found;
}

}  // namespace dimmer::cook
