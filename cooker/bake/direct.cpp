#include <bake/direct.h>

#include <bake/punctual.h>
#include <bake/sampling.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// A far light's shadow changes little across a texel's points: one ray, from a point that differs between lights.
constexpr float near_m = 10;
constexpr float sun_distance_m = 1e30f;

}  // namespace

uint64_t directLight(const RayScene& rays, const LightGrid& grid, const Unwrap& unwrap, const Texels& texels,
                     size_t receiver, GroupAccumulator<Gathered>& reflected, GroupAccumulator<Gathered>& stored) {
    const auto seed = static_cast<uint32_t>(receiver);
    const uint32_t points = texels.sampleCount(receiver);
    const glm::vec3 place = texels.sample(receiver, 0).position_m;
    uint64_t traced = 0;
    grid.forEach(place, [&](uint32_t l) {
        const PunctualLight& light = rays.scene().lights[l];
        const uint32_t first = hash(grid.identity(l), seed) % points;
        const bool near = light.type == LightType::Directional || glm::distance(light.position_m, place) < near_m;
        const uint32_t used = near ? points : 1;
        for (uint32_t i = 0; i < used; ++i) {
            const SamplePoint& p = texels.sample(receiver, (first + i) % points);
            const TangentFrame& frame = unwrap.frames[p.face];
            const Illumination lit = illuminate(light, p.position_m);
            const float cos_surface = glm::dot(frame.normal, lit.towards_light);
            if (!(cos_surface > 0) || !(luminance(lit.irradiance_lux) > 0)) continue;
            ++traced;
            const float passed = rays.transmittance(p.position_m, lit.towards_light,
                                                    std::isinf(lit.distance_m) ? sun_distance_m : lit.distance_m);
            if (!(passed > 0)) continue;
            const glm::vec3 lux = lit.irradiance_lux * (cos_surface * passed / static_cast<float>(used));
            const glm::vec3 direction(glm::dot(lit.towards_light, frame.tangent),
                                      glm::dot(lit.towards_light, frame.bitangent), cos_surface);
            const uint32_t group = groupOf(light.light_set);
            reflected[group].add(lux, direction);
            if (light.bake == BakeMode::Full) stored[group].add(lux, direction);
        }
    });
    return traced;
}

}  // namespace dimmer::cook
