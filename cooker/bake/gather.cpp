#include <bake/gather.h>

#include <bake/door_rays.h>
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

struct Gatherer::Ray {
    const GatherFrom& from;
    const GatherOptions& options;
    const SparseLight* outgoing;
    TermAccumulator<Gathered>& sum;
    GatherLinks* links;
    uint32_t i;  // in this gather
    glm::vec3 origin, world, tangent;
    float lux_per_radiance;
};

void Gatherer::gather(const GatherFrom& from, const GatherOptions& options, const SparseLight* outgoing,
                      TermAccumulator<Gathered>& sum, GatherLinks* links) const {
    const uint32_t seed = hash(options.seed, from.id);
    const bool sky = rays_.scene().sky_radiance_cd_m2 != glm::vec3(0);
    const float lux_per_radiance = pi / static_cast<float>(options.rays);
    for (uint32_t i = 0; i < options.rays; ++i) {
        const uint32_t index = options.first_ray + i;
        const SamplePoint& origin = from.points[index % from.points.size()];
        const TangentFrame& frame = unwrap_.frames[origin.face];
        const glm::vec3 d = cosineDirection(sequence2d(index, seed));
        const glm::vec3 world = frame.tangent * d.x + frame.bitangent * d.y + frame.normal * d.z;
        const Ray ray{from, options, outgoing, sum, links, i, origin.position_m, world, d, lux_per_radiance};
        const auto hit = rays_.nearest(origin.position_m, world, far_away_m, seed + index, Surfaces::Walls);
        if (links) links->hits[i] = no_index;
        const uint32_t path = rays_.anyLeaf() ? throughLeaves(ray, hit ? hit->distance_m : far_away_m) : free_path;
        if (path == no_path) continue;
        if (hit) {
            take(ray, *hit, path);
        } else if (const uint32_t term = paths_.term(always_group, path); sky && term != no_term && sum.wants(term)) {
            sum[term].add(missed(options, world, d.z) * lux_per_radiance, d);
        }
    }
    if (!emitters_.empty() && options.emitter_samples > 0) sampleEmitters(from, options, sum);
    if (!sky_.empty() && options.emitter_samples > 0) sampleSky(from, options, sum);
}

// Takes what the leaves along a ray send back. Returns the path on which it goes on behind them.
uint32_t Gatherer::throughLeaves(const Ray& ray, float distance_m) const {
    uint32_t path = free_path;
    for (const Hit& hit : rays_.leavesAlong(ray.origin, ray.world, distance_m)) {
        const uint32_t condition = rays_.triangles()[hit.triangle].condition;
        const Leaf leaf = paths_.leaf(path, ray.from.condition, condition);
        if (leaf == Leaf::Absent) continue;
        const float stopped = rays_.alphaAt(hit.triangle, hit.u, hit.v);
        const uint32_t chance = hash(hash(ray.options.seed, ray.from.id), ray.options.first_ray + ray.i);
        if (stopped < 1 && unitFloat(hash(chance, hit.triangle)) >= stopped) continue;
        if (ray.links) ray.links->doors.push_back(condition / 2);
        if (leaf == Leaf::There) {
            take(ray, hit, path);
            return no_path;
        }
        if (const uint32_t reflecting = paths_.with(path, condition); reflecting != no_path) take(ray, hit, reflecting);
        path = paths_.with(path, condition ^ 1);
        if (path == no_path) return no_path;
    }
    return path;
}

// Takes the light of the surface at a ray's end.
void Gatherer::take(const Ray& ray, const Hit& hit, uint32_t path) const {
    if (const Emitter* e = emitters_.emitterOf(hit.triangle); e && (!hit.back || e->double_sided)) {
        const float cos_emitter = std::abs(glm::dot(ray.world, e->normal));
        const float by_area = static_cast<float>(ray.options.emitter_samples) *
                              emitters_.pdf(emitters_.cellAt(ray.origin), *e, hit.distance_m, cos_emitter);
        const float by_hit = static_cast<float>(ray.options.rays) * ray.tangent.z / pi;
        if (const uint32_t term = paths_.term(e->group, path); term != no_term && ray.sum.wants(term))
            ray.sum[term].add(e->radiance_cd_m2 * (ray.lux_per_radiance * by_hit / (by_hit + by_area)), ray.tangent);
    }
    const uint32_t found = receiverOf(unwrap_, texels_, hit);
    if (found == no_index) return;
    if (ray.links && path == free_path) ray.links->hits[ray.i] = found;
    if (ray.links && path != free_path) ray.links->through_doors.push_back({found, path});
    if (!ray.outgoing) return;
    const bool as_it_is = path == free_path && ray.from.condition == no_condition;
    for (const TermLight& light : ray.outgoing->row(found)) {
        const uint32_t term = as_it_is ? light.term : paths_.moved(light.term, path, ray.from.condition);
        if (term != no_term && ray.sum.wants(term)) ray.sum[term].add(light.value * ray.lux_per_radiance, ray.tangent);
    }
}

// The sky's radiance along a ray that hit nothing, times its share of the two ways to find it.
glm::vec3 Gatherer::missed(const GatherOptions& options, glm::vec3 world, float cos_surface) const {
    const glm::vec3 radiance = skyRadiance(rays_.scene(), world);
    if (sky_.empty()) return radiance;
    const float by_sky = static_cast<float>(options.emitter_samples) * sky_.pdf(radiance);
    const float by_cosine = static_cast<float>(options.rays) * cos_surface / pi;
    return radiance * (by_cosine / (by_cosine + by_sky));
}

void Gatherer::sampleSky(const GatherFrom& from, const GatherOptions& options, TermAccumulator<Gathered>& sum) const {
    const uint32_t seed = hash(options.seed ^ 0x3c6ef372u, from.id);
    for (uint32_t i = 0; i < options.emitter_samples; ++i) {
        const uint32_t index = firstSample(options) + i;
        const SamplePoint& origin = from.points[(index + seed) % from.points.size()];
        const SkySample s = sky_.sample(sequence2d(index, seed));
        const glm::vec3 d = toTangent(unwrap_.frames[origin.face], s.direction);
        if (!(s.pdf > 0) || !(d.z > 0)) continue;
        const float by_sky = static_cast<float>(options.emitter_samples) * s.pdf;
        const float by_cosine = static_cast<float>(options.rays) * d.z / pi;
        forEachWay(rays_, paths_, from.condition, origin.position_m, s.direction, far_away_m,
                   [&](float passed, uint32_t path) {
                       if (const uint32_t term = paths_.term(always_group, path); term != no_term && sum.wants(term))
                           sum[term].add(s.radiance_cd_m2 * (passed * d.z / (by_sky + by_cosine)), d);
                   });
    }
}

// The path of light that starts on a surface which is there under `target`.
uint32_t Gatherer::onto(uint32_t path, uint32_t own, uint32_t target) const {
    if (target == no_condition) return path;
    switch (paths_.leaf(path, own, target)) {
        case Leaf::Absent:
            return no_path;
        case Leaf::There:
            return path;
        case Leaf::Either:
            return paths_.with(path, target);
    }
    return no_path;
}

void Gatherer::sampleEmitters(const GatherFrom& from, const GatherOptions& options,
                              TermAccumulator<Gathered>& sum) const {
    const auto samples = static_cast<float>(options.emitter_samples);
    const uint32_t any_point = hash(options.seed, from.id);
    for (uint32_t i = 0; i < options.emitter_samples; ++i) {
        const uint32_t index = firstSample(options) + i;
        const SamplePoint& origin = from.points[(index + any_point) % from.points.size()];
        const TangentFrame& frame = unwrap_.frames[origin.face];
        for (const auto& range : emitters_.groups(emitters_.cellAt(origin.position_m))) {
            if (!options.wanted_in_group.empty() && options.wanted_in_group[range.group] == 0) continue;
            // Seeded by the group alone, not by its place in a list: other sets do not change its noise.
            const uint32_t seed = hash(hash(options.seed ^ 0x5bd1e995u, from.id), range.group);
            const float choice = (static_cast<float>(i) + unitFloat(hash(seed, index))) / samples;
            const EmitterSample s = emitters_.sample(range, origin.position_m, choice, sequence2d(index, seed));
            const glm::vec3 d = toTangent(frame, s.direction);
            if (!(s.pdf > 0) || !(d.z > 0)) continue;
            const float by_area = samples * s.pdf, by_hit = static_cast<float>(options.rays) * d.z / pi;
            const uint32_t target = rays_.triangles()[s.triangle].condition;
            forEachWay(rays_, paths_, from.condition, origin.position_m, s.direction, s.distance_m * shadow_end_share,
                       [&](float passed, uint32_t path) {
                           const uint32_t term = paths_.term(range.group, onto(path, from.condition, target));
                           if (term != no_term && sum.wants(term))
                               sum[term].add(s.radiance_cd_m2 * (passed * d.z / (by_area + by_hit)), d);
                       });
        }
    }
}

}  // namespace dimmer::cook
