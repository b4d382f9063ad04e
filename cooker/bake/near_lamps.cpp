#include <bake/near_lamps.h>

#include <bake/punctual.h>
#include <bake/texel_pieces.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr float near_widths = 2;
// Between the middle of what the points are on and theirs: what hides a fifth of a texel moves it as far.
constexpr float apart_max_widths = 0.1f;

}  // namespace

float nearLampScale(const Gatherer& gatherer, const GatherFrom& from, glm::vec3 lamp_m) {
    if (from.texel == no_index) return 1;
    const float width_m = std::sqrt(gatherer.texels().area_m2[from.texel]), reach_m = near_widths * width_m;
    const auto isNear = [&](const SamplePoint& p) { return glm::distance(p.position_m, lamp_m) < reach_m; };
    if (std::ranges::none_of(from.points, isNear)) return 1;
    const TexelPieces pieces(gatherer, from);
    if (!(pieces.areaM2() > 0)) return 1;
    // Of an even lamp of 1 cd, as illuminate() has it.
    double points_lux = 0;
    glm::dvec3 middle(0);
    for (const SamplePoint& p : from.points) {
        const glm::dvec3 to_lamp = glm::dvec3(lamp_m) - glm::dvec3(p.position_m);
        const double distance_m = glm::length(to_lamp);
        const double height_m = glm::dot(to_lamp, glm::dvec3(gatherer.frameOf(p).normal));
        const double clamped_m = std::max(distance_m, static_cast<double>(lamp_distance_min_m));
        if (height_m > 0) points_lux += height_m / (distance_m * clamped_m * clamped_m);
        middle += glm::dvec3(p.position_m);
    }
    const auto count = static_cast<double>(from.points.size());
    if (glm::distance(middle / count, pieces.centreM()) > static_cast<double>(apart_max_widths * width_m)) return 1;
    const double scale = pieces.solidAngleFrom(lamp_m) / pieces.areaM2() / (points_lux / count);
    return std::isfinite(scale) ? static_cast<float>(scale) : 1;  // no point sees it; or it is a corner of the texel
}

}  // namespace dimmer::cook
