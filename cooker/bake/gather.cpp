#include <bake/gather.h>

#include <bake/sampling.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

constexpr float far_away_m = 1e30f;
// Shadow rays stop this short of the emitter they aim at, so as not to hit it.
constexpr float shadow_end_share = 1 - 1e-4f;

glm::vec3 toTangent(const TangentFrame& f, glm::vec3 d) {
    return {glm::dot(d, f.tangent), glm::dot(d, f.bitangent), glm::dot(d, f.normal)};
}

// Where the samples of this round begin in the sequence of all rounds: they take turns at the texel's points.
uint32_t firstSample(const GatherOptions& options) {
    return options.first_ray / std::max(options.rays, 1u) * options.emitter_samples;
}

}  // namespace

void Gathered::add(glm::vec3 lux, glm::vec3 direction_tangent) {
    irradiance_lux += lux;
    // Per unit of irradiance on the surface, whose cosine is z. Light along the surface is bounded, as single rays that
    // graze it would be mostly noise: of an overcast sky the tilted normals lose 0.4 %.
    constexpr float z_min = 0.02f;
    const glm::vec2 slope = direction_tangent * (tilt_sin / std::max(direction_tangent.z, z_min));
    tilted_lux += luminance(lux) * glm::max(glm::vec4(slope, -slope) + tilt_cos, 0.0f);
}

void Gatherer::gather(const GatherFrom& from, const GatherOptions& options, const SparseLight* outgoing,
                      GroupAccumulator<Gathered>& sum, uint32_t* hits) const {
    const uint32_t seed = hash(options.seed, from.id);
    const bool sky = rays_.scene().sky_radiance_cd_m2 != glm::vec3(0);
    const float lux_per_radiance = pi / static_cast<float>(options.rays);
    for (uint32_t i = 0; i < options.rays; ++i) {
        const uint32_t index = options.first_ray + i;
        const SamplePoint& origin = from.points[index % from.points.size()];
        const TangentFrame& frame = unwrap_.frames[origin.face];
        const glm::vec3 d = cosineDirection(sequence2d(index, seed));
        const glm::vec3 world = frame.tangent * d.x + frame.bitangent * d.y + frame.normal * d.z;
        const auto hit = rays_.nearest(origin.position_m, world, far_away_m, seed + index);
        if (hits) hits[i] = no_index;
        if (!hit) {
            if (sky) sum[always_group].add(missed(options, world, d.z) * lux_per_radiance, d);
            continue;
        }
        if (const Emitter* e = emitters_.emitterOf(hit->triangle); e && (!hit->back || e->double_sided)) {
            const float cos_emitter = std::abs(glm::dot(world, e->normal));
            const float by_area = static_cast<float>(options.emitter_samples) *
                                  emitters_.pdf(emitters_.cellAt(origin.position_m), *e, hit->distance_m, cos_emitter);
            const float by_hit = static_cast<float>(options.rays) * d.z / pi;
            sum[e->group].add(e->radiance_cd_m2 * (lux_per_radiance * by_hit / (by_hit + by_area)), d);
        }
        const uint32_t found = receiverOf(unwrap_, texels_, *hit);
        if (found == no_index) continue;
        if (hits) hits[i] = found;
        if (!outgoing) continue;
        for (const GroupLight& light : outgoing->row(found)) sum[light.group].add(light.value * lux_per_radiance, d);
    }
    if (!emitters_.empty() && options.emitter_samples > 0) sampleEmitters(from, options, sum);
    if (!sky_.empty() && options.emitter_samples > 0) sampleSky(from, options, sum);
}

// The sky's radiance along a ray that hit nothing, times its share of the two ways to find it.
glm::vec3 Gatherer::missed(const GatherOptions& options, glm::vec3 world, float cos_surface) const {
    const glm::vec3 radiance = skyRadiance(rays_.scene(), world);
    if (sky_.empty()) return radiance;
    const float by_sky = static_cast<float>(options.emitter_samples) * sky_.pdf(radiance);
    const float by_cosine = static_cast<float>(options.rays) * cos_surface / pi;
    return radiance * (by_cosine / (by_cosine + by_sky));
}

void Gatherer::sampleSky(const GatherFrom& from, const GatherOptions& options, GroupAccumulator<Gathered>& sum) const {
    const uint32_t seed = hash(options.seed ^ 0x3c6ef372u, from.id);
    for (uint32_t i = 0; i < options.emitter_samples; ++i) {
        const uint32_t index = firstSample(options) + i;
        const SamplePoint& origin = from.points[(index + seed) % from.points.size()];
        const SkySample s = sky_.sample(sequence2d(index, seed));
        const glm::vec3 d = toTangent(unwrap_.frames[origin.face], s.direction);
        if (!(s.pdf > 0) || !(d.z > 0)) continue;
        const float passed = rays_.transmittance(origin.position_m, s.direction, far_away_m);
        if (!(passed > 0)) continue;
        const float by_sky = static_cast<float>(options.emitter_samples) * s.pdf;
        const float by_cosine = static_cast<float>(options.rays) * d.z / pi;
        sum[always_group].add(s.radiance_cd_m2 * (passed * d.z / (by_sky + by_cosine)), d);
    }
}

void Gatherer::sampleEmitters(const GatherFrom& from, const GatherOptions& options,
                              GroupAccumulator<Gathered>& sum) const {
    const auto samples = static_cast<float>(options.emitter_samples);
    const uint32_t any_point = hash(options.seed, from.id);
    for (uint32_t i = 0; i < options.emitter_samples; ++i) {
        const uint32_t index = firstSample(options) + i;
        const SamplePoint& origin = from.points[(index + any_point) % from.points.size()];
        const TangentFrame& frame = unwrap_.frames[origin.face];
        for (const auto& range : emitters_.groups(emitters_.cellAt(origin.position_m))) {
            // Seeded by the group alone, not by its place in a list: other sets do not change its noise.
            const uint32_t seed = hash(hash(options.seed ^ 0x5bd1e995u, from.id), range.group);
            const float choice = (static_cast<float>(i) + unitFloat(hash(seed, index))) / samples;
            const EmitterSample s = emitters_.sample(range, origin.position_m, choice, sequence2d(index, seed));
            const glm::vec3 d = toTangent(frame, s.direction);
            if (!(s.pdf > 0) || !(d.z > 0)) continue;
            const float by_area = samples * s.pdf, by_hit = static_cast<float>(options.rays) * d.z / pi;
            const float passed = rays_.transmittance(origin.position_m, s.direction, s.distance_m * shadow_end_share);
            if (passed > 0) sum[range.group].add(s.radiance_cd_m2 * (passed * d.z / (by_area + by_hit)), d);
        }
    }
}

}  // namespace dimmer::cook
