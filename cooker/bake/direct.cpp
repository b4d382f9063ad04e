#include <bake/direct.h>

#include <bake/door_rays.h>
#include <bake/narrow_beams.h>
#include <bake/near_lamps.h>
#include <bake/punctual.h>
#include <bake/sampling.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// What a far light's shadow changes across a texel is little beside what the texel's neighbours get, and only
// reflected: one ray, from a point that differs between lights.
constexpr float near_m = 10;

}  // namespace

template <class Light>
uint64_t directLight(const Gatherer& gatherer, const LightGrid& grid, const GatherFrom& from,
                     TermAccumulator<Light>& reflected, TermAccumulator<Light>& stored, uint32_t points_max) {
    const RayScene& rays = gatherer.rays();
    const DoorPaths& paths = gatherer.paths();
    const auto points = static_cast<uint32_t>(from.points.size());
    uint64_t traced = 0;
    // `lit`: at the point; `arrives_lux`: on its surface, if nothing is between.
    const auto addArriving = [&](const PunctualLight& light, const SamplePoint& p, const Illumination& lit,
                                 glm::vec3 direction, glm::vec3 arrives_lux) {
        ++traced;
        const float distance_m = shadowRayLengthM(lit);
        forEachWay(rays, paths, from.condition, from.ignored, p.position_m, lit.towards_light, distance_m,
                   [&](float passed, uint32_t path) {
                       const uint32_t term = paths.term(groupOf(light.light_set), path);
                       if (term == no_term) return;
                       const glm::vec3 lux = arrives_lux * passed;
                       const auto weights = Light::weightsOf(direction);
                       reflected[term].add(lux, weights);
                       if (light.bake == BakeMode::Full) stored[term].add(lux, weights);
                   });
    };
    // What lies in `beam` is found without points.
    const auto addLight = [&](const PunctualLight& light, const SamplePoint& p, float share,
                              const NarrowBeam* beam = nullptr) {
        const Illumination lit = illuminate(light, p.position_m);
        if (beam && beam->holds(lit.towards_light)) return;
        const glm::vec3 direction = gatherer.toTangent(p, lit.towards_light);
        const float weight = Light::Intake::weight(direction);
        if (!(weight > 0) || !(luminance(lit.irradiance_lux) > 0)) return;
        addArriving(light, p, lit, direction, lit.irradiance_lux * (weight * share));
    };
    const std::vector<PunctualLight>& lights = rays.scene().lights;
    const auto scaleOf = [&](const PunctualLight& light) {
        return light.type == LightType::Directional ? 1.0f : nearLampScale(gatherer, from, light.position_m);
    };
    if (from.wide) {
        for (const SamplePoint& p : from.points)
            grid.forEach(p.position_m,
                         [&](uint32_t l) { addLight(lights[l], p, scaleOf(lights[l]) / static_cast<float>(points)); });
        return traced;
    }
    const glm::vec3 place = from.points[0].position_m;
    grid.forEach(place, [&](uint32_t l) {
        const PunctualLight& light = lights[l];
        const auto beam = narrowBeam(gatherer, from, light);
        if (beam) {
            for (const auto& [p, lux] : beam->places) {
                const Illumination lit = illuminate(light, p.position_m);
                addArriving(light, p, lit, gatherer.toTangent(p, lit.towards_light), lux);
            }
            if (light.type == LightType::Spot) return;  // that is all of it
        }
        const float scale = scaleOf(light);
        const uint32_t first = hash(grid.identity(l), from.id) % points;
        // Shadows that are stored are seen, and have edges at any distance.
        const bool all = light.type == LightType::Directional || light.bake == BakeMode::Full ||
                         glm::distance(light.position_m, place) < near_m;
        const uint32_t used = scale != 1 ? points : all ? std::min(points, points_max) : 1;
        for (uint32_t i = 0; i < used; ++i)
            addLight(light, from.points[(first + i) % points], scale / static_cast<float>(used),
                     beam ? &*beam : nullptr);
    });
    return traced;
}

template uint64_t directLight(const Gatherer&, const LightGrid&, const GatherFrom&, TermAccumulator<Gathered>&,
                              TermAccumulator<Gathered>&, uint32_t);
template uint64_t directLight(const Gatherer&, const LightGrid&, const GatherFrom&, TermAccumulator<ProbeLight>&,
                              TermAccumulator<ProbeLight>&, uint32_t);

}  // namespace dimmer::cook
