#include <bake/gather.h>

#include <bake/door_rays.h>
#include <bake/sampling.h>
#include <probes/spherical_harmonics.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>

namespace dimmer::cook {
namespace {

// Rays end anywhere, and light there takes as long to come from memory as a ray takes to trace: it is asked for when so
// many rays have been traced. Where ends are known, whether any is wanted is asked before: so many rays ahead it begins
// to load.
constexpr uint32_t rays_ahead = 8;

// Where the samples of this round, so many in each, begin in the sequence of all rounds: they take turns at the texel's
// points.
uint32_t firstSample(const GatherOptions& options, uint32_t samples) {
    return options.first_ray / std::max(options.rays, 1u) * samples;
}

}  // namespace

Gathered::Weights Gathered::weightsOf(glm::vec3 direction_tangent) {
    // Per unit of irradiance on the surface, whose cosine is z. Light along the surface is bounded, as single rays that
    // graze it would be mostly noise: of an overcast sky the tilted normals lose 0.4 %.
    constexpr float z_min = 0.02f;
    const glm::vec2 slope = direction_tangent * (tilt_sin / std::max(direction_tangent.z, z_min));
    return glm::max(glm::vec4(slope, -slope) + tilt_cos, 0.0f);
}

ProbeLight::Weights ProbeLight::weightsOf(glm::vec3 d) {
    const auto y = sphericalHarmonics({d.x, d.y, d.z});
    Weights weights;
    for (size_t k = 0; k < y.size(); ++k) weights[3 * k] = weights[3 * k + 1] = weights[3 * k + 2] = y[k];
    return weights;
}

// The innermost work of every ray of a probe: the 27 numbers eight at a time, against lux in three rotations.
void ProbeLight::add(glm::vec3 lux, const Weights& weights) {
    using Four [[gnu::vector_size(16)]] = float;
    using Eight [[gnu::vector_size(32)]] = float;
    static_assert(sizeof radiance == 27 * sizeof(float));
    const Four rgb = {lux.x, lux.y, lux.z, 0};
    const std::array<Eight, 3> turns = {__builtin_shufflevector(rgb, rgb, 0, 1, 2, 0, 1, 2, 0, 1),
                                        __builtin_shufflevector(rgb, rgb, 2, 0, 1, 2, 0, 1, 2, 0),
                                        __builtin_shufflevector(rgb, rgb, 1, 2, 0, 1, 2, 0, 1, 2)};
    for (size_t i = 0; i < 3; ++i) {
        Eight sum, weight;
        std::memcpy(&weight, &weights[8 * i], sizeof weight);
        char* const at = reinterpret_cast<char*>(&radiance) + i * sizeof sum;
        std::memcpy(&sum, at, sizeof sum);
        sum += turns[i] * weight;
        std::memcpy(at, &sum, sizeof sum);
    }
    radiance[8] += lux * weights[24];
}

glm::vec3 ProbeLight::irradiance(glm::vec3 n) const {
    const auto y = sphericalHarmonics({n.x, n.y, n.z});
    glm::vec3 sum(0);
    for (size_t i = 0; i < 9; ++i) sum += radiance[i] * (cosine_bands[bandOf(i)] * y[i]);
    return sum;
}

// What a ray's radiance counts for in the terms of the first aims, once one has asked (a bit each): many share one.
struct Gatherer::AimShares {
    AimShares() {}  // most rays ask for none: not even zeros
    uint32_t asked = 0;
    std::array<float, 16> of_aim;
};

// Of the leaves along a ray.
struct Gatherer::LeavesMet {
    bool any = false, shines = false;
    std::vector<PathEnd>* through = nullptr;  // takes what the ray reads of them
};

template <class Light>
struct Gatherer::Ray {
    using Intake = typename Light::Intake;
    float density(uint32_t path) const { return Intake::weight(tangent) / alone(path); }
    // What radiance at the ray's end counts for, where no other kind of ray might have found it.
    float alone(uint32_t path) const { return Intake::total / static_cast<float>(options.raysOver(path)); }
    bool forDoors() const { return aim == 0 && i >= options.rays; }
    const GatherFrom& from;
    const GatherOptions& options;
    const SparseLight* outgoing;
    TermAccumulator<Light>& sum;
    GatherLinks* links;
    const DoorAims& aims;
    uint32_t aim;       // whose ray this is, as DoorAims::of_term has it; 0: a ray by the intake
    uint32_t i, point;  // in this gather; of the receiver
    glm::vec3 origin, world, tangent;
    Batch<Light>& batch;
    mutable AimShares shares{};  // of no ray but this one
    typename Light::Weights weights = Light::weightsOf(tangent);
};

// Rays that were traced, and what they bring, in order. All that a ray brings waits here, be it there at once or not:
// where a batch ends depends on what else is baked and on which ends are known, and what is added up in another order
// is another sum.
template <class Light>
struct Gatherer::Batch {
    enum class What : uint8_t { Receiver, Sky, Emitter };
    struct End {
        uint32_t ray;
        What what;
        uint32_t number, path;  // the receiver, or of `emitted`
    };
    struct Emitted {
        uint32_t term;
        glm::vec3 lux;
    };
    // A surface for each leaf that a ray meets, and one behind them; each may shine as well.
    static constexpr uint32_t hits_max = rays_ahead * (LeafHits::max + 1);

    explicit Batch(const Gatherer& of) : gatherer(of) {}

    // For its ray, until the next flush.
    std::optional<Ray<Light>>& next() {
        if (rays == rays_ahead) flush();
        return traced[rays++];
    }
    void readLater(uint32_t receiver, uint32_t path) { put(What::Receiver, receiver, path); }
    void takeSkyLater(uint32_t path) { put(What::Sky, 0, path); }
    void addLater(uint32_t term, glm::vec3 lux) {
        emitted[emitted_count] = {term, lux};
        put(What::Emitter, emitted_count++, free_path);
    }
    void flush() {
        for (uint32_t e = 0; e < count; ++e) {
            const End& end = ends[e];
            const Ray<Light>& ray = *traced[end.ray];
            switch (end.what) {
                case What::Receiver:
                    gatherer.takeFrom(ray, end.number, end.path);
                    break;
                case What::Sky:
                    gatherer.takeSky(ray, end.path);
                    break;
                case What::Emitter:
                    ray.sum[emitted[end.number].term].add(emitted[end.number].lux, ray.weights);
                    break;
            }
        }
        rays = count = emitted_count = 0;
    }

   private:
    void put(What what, uint32_t number, uint32_t path) { ends[count++] = {rays - 1, what, number, path}; }

    const Gatherer& gatherer;
    uint32_t rays = 0, count = 0, emitted_count = 0;
    std::array<std::optional<Ray<Light>>, rays_ahead> traced;
    std::array<End, 2 * hits_max> ends;
    std::array<Emitted, hits_max> emitted;
};

TangentFrame Gatherer::frameOf(const SamplePoint& point) const {
    if (point.face < unwrap_.frames.size()) return unwrap_.frames[point.face];
    if (point.face == no_face) return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    if (point.face >= first_receiver_face) return receiverFrame(point.face);
    TangentFrame frame;
    frame.normal = rays_.triangles()[(point.face & ~triangle_faces) / 2].normal * (point.face % 2 ? -1.0f : 1.0f);
    orthonormalBasis(frame.normal, frame.tangent, frame.bitangent);
    return frame;
}

glm::vec3 Gatherer::toTangent(const SamplePoint& point, glm::vec3 d) const {
    if (point.face == no_face) return d;
    const auto in = [&](const TangentFrame& f) {
        return glm::vec3(glm::dot(d, f.tangent), glm::dot(d, f.bitangent), glm::dot(d, f.normal));
    };
    return point.face < unwrap_.frames.size() ? in(unwrap_.frames[point.face]) : in(frameOf(point));
}

template <class Light>
void Gatherer::gather(const GatherFrom& from, const GatherOptions& options, const SparseLight* outgoing,
                      TermAccumulator<Light>& sum, GatherLinks* links, const DoorAims& aims) const {
    const uint32_t seed = hash(options.seed, from.id);
    Batch<Light> batch(*this);
    for (uint32_t i = 0; i < options.rays + (rays_.anyLeaf() ? options.door_rays : 0); ++i) {
        const uint32_t index = options.first_ray + i;
        const bool remembered = options.row && i < options.rays && index < options.row->ends.size();
        const uint32_t end = remembered ? options.row->ends[index] : RayEnd::again;
        if (links && i < options.rays) links->hits[i] = end < RayEnd::through ? end : no_index;
        if (const uint32_t ahead = index + rays_ahead; remembered && outgoing && ahead < options.row->ends.size())
            if (options.row->ends[ahead] < RayEnd::through) outgoing->prefetch(options.row->ends[ahead]);
        const PathEnd only{free_path, end, true};
        std::span<const PathEnd> known;
        if (end == RayEnd::through)
            known = options.row->takeThrough();
        else if (end < RayEnd::again)
            known = {&only, 1};
        if (!known.empty() && !brings(known, from, outgoing, sum)) continue;
        const auto point = static_cast<uint32_t>(index % from.points.size());
        const SamplePoint& origin = from.points[point];
        const TangentFrame frame = frameOf(origin);
        const glm::vec3 d = Light::Intake::direction(sequence2d(index, seed));
        const glm::vec3 world = frame.tangent * d.x + frame.bitangent * d.y + frame.normal * d.z;
        const Ray<Light>& ray = batch.next().emplace(from, options, outgoing, sum, links, aims, 0u, i, point,
                                                     origin.position_m, world, d, batch);
        for (const PathEnd& p : known)
            if (p.end == RayEnd::sky)
                batch.takeSkyLater(p.path);
            else if (outgoing)
                batch.readLater(p.end, p.path);
        if (!known.empty()) continue;
        // Links have other uses for leaves.
        const bool remember = end == RayEnd::unknown;
        const uint32_t found = follow(ray, seed + index, remember && !links ? &options.row->through : nullptr);
        if (!remember) continue;
        options.row->ends[index] = found;
        options.row->next = options.row->through.size();
    }
    for (size_t a = 0; a < aims.all.size(); ++a)
        if (aims.wanted[a] > 0) gatherAimed(from, options, outgoing, sum, aims, a, batch);
    batch.flush();
    if (!emitters_.empty() && options.emitter_samples > 0) sampleEmitters(from, options, sum);
    if (!sky_.empty() && options.emitter_samples > 0) sampleSky(from, options, sum);
}

uint32_t Gatherer::guideOf(uint32_t term) const {
    const uint32_t door = paths_.onlyDoor(term);
    return door == no_door ? no_guide : guides_->guideOf(door, paths_.terms()[term].group);
}

DoorAim Gatherer::aimAt(const GatherFrom& from, uint32_t guide) const {
    DoorAim aim{guide, guides_->ownGroup(guide), {}};
    for (const SamplePoint& p : from.points)
        aim.from_point.emplace_back(guides_->boxes(guide), p.position_m,
                                    p.face == no_face ? glm::vec3(0) : frameOf(p).normal);
    return aim;
}

template <class Light>
void Gatherer::gatherAimed(const GatherFrom& from, const GatherOptions& options, const SparseLight* outgoing,
                           TermAccumulator<Light>& sum, const DoorAims& aims, size_t a, Batch<Light>& batch) const {
    const DoorAim& aim = aims.all[a];
    // Seeded by the guide alone: what else is aimed at does not change its noise.
    const uint32_t seed = hash(hash(options.seed ^ 0x1b873593u, from.id), guides_->identity(aim.guide));
    for (uint32_t i = 0; i < aimed_rays; ++i) {
        // The rays of all rounds are one sequence.
        const uint32_t index = options.first_ray * aimed_rays / options.rays + i;
        const auto point = static_cast<uint32_t>(index % from.points.size());
        const SamplePoint& origin = from.points[point];
        const Guide& guide = aim.from_point[point];
        if (guide.empty()) continue;
        const glm::vec3 u = sequence3d(index, seed);
        const glm::vec3 world = guide.sample(u.z, {u.x, u.y});
        const glm::vec3 d = toTangent(origin, world);
        if (!(Light::Intake::weight(d) > 0)) continue;
        follow(batch.next().emplace(from, options, outgoing, sum, nullptr, aims, static_cast<uint32_t>(a + 1),
                                    options.rays + i, point, origin.position_m, world, d, batch),
               seed + index);
    }
}

// The term that light of a group over a path is added to; no_term where nobody wants it.
template <class Light>
uint32_t Gatherer::wantedOf(uint32_t group, uint32_t path, const TermAccumulator<Light>& sum) const {
    const uint32_t term = paths_.term(group, path);
    return term == no_term ? no_term : sum.into(term);
}

// Whether a ray with known ends can bring anything that is wanted.
template <class Light>
bool Gatherer::brings(std::span<const PathEnd> ends, const GatherFrom& from, const SparseLight* outgoing,
                      const TermAccumulator<Light>& sum) const {
    return std::ranges::any_of(ends, [&](const PathEnd& p) {
        if (p.end == RayEnd::nothing) return false;
        if (p.end == RayEnd::sky) {
            return wantedOf(always_group, p.path, sum) != no_term;
        }
        if (!outgoing || !outgoing->any(p.end)) return false;
        if (from.condition != no_condition || p.path != free_path) return true;
        return std::ranges::any_of(outgoing->row(p.end), [&](const TermLight& l) { return sum.wants(l.term); });
    });
}

// Traces a ray and takes what it finds. Returns where it ended; `through`, when given, takes what it reads where it met
// leaves: else such a ray ends nowhere that could be told.
template <class Light>
uint32_t Gatherer::follow(const Ray<Light>& ray, uint32_t seed, std::vector<PathEnd>* through) const {
    if (ray.forDoors() && !rays_.mayMeetLeaf(ray.origin, ray.world)) return RayEnd::again;
    LeafHits leaves;
    const auto hit = rays_.nearest(ray.origin, ray.world, far_away_m, seed, Surfaces::Walls, ray.from.ignored,
                                   rays_.anyLeaf() ? &leaves : nullptr);
    const size_t first = through ? through->size() : 0;
    LeavesMet met{.through = through};
    const uint32_t path = throughLeaves(ray, leaves, met);
    uint32_t end = RayEnd::nothing;
    bool shines = met.shines;
    if (path == no_path || (path == free_path && ray.forDoors())) {
        // Stopped by a leaf, or not for this ray.
    } else if (!hit) {
        ray.batch.takeSkyLater(path);
        end = RayEnd::sky;
    } else {
        if (const uint32_t found = take(ray, *hit, path); found != no_index) end = found;
        shines = shines || emitters_.emitterOf(hit->triangle);
    }
    if (shines || (met.any && !through)) {
        if (through) through->resize(first);
        return RayEnd::again;
    }
    if (!met.any) return end;
    if (end != RayEnd::nothing) through->push_back({path, end});
    if (through->size() == first) return RayEnd::nothing;
    through->back().last = true;
    return RayEnd::through;
}

// From the radiance at a ray's end to its share of the irradiance in an aim's terms: by the densities of all rays that
// might have found it there.
template <class Light>
float Gatherer::shareOf(const Ray<Light>& ray, uint32_t path, uint32_t aim) const {
    const uint32_t bit = aim < ray.shares.of_aim.size() ? 1u << aim : 0;
    if (ray.shares.asked & bit) return ray.shares.of_aim[aim];
    const Guide& guide = ray.aims.all[aim].from_point[ray.point];
    const float by_aim = guide.empty() ? 0 : static_cast<float>(aimed_rays) * guide.pdf(ray.world);
    const float share = Light::Intake::weight(ray.tangent) / (ray.density(path) + by_aim);
    if (bit) ray.shares.of_aim[aim] = share;
    ray.shares.asked |= bit;
    return share;
}

// Adds radiance at a ray's end to a term that has `aim`, counted as in DoorAims::of_term.
template <class Light>
void Gatherer::add(const Ray<Light>& ray, uint32_t path, uint32_t term, glm::vec3 radiance, uint32_t aim) const {
    if (ray.aim != 0 && ray.aim != aim) return;
    const float alone = ray.alone(path), share = aim != 0 ? shareOf(ray, path, aim - 1) : alone;
    const glm::vec3 lux = radiance * share;
    ray.sum[term].add(lux, ray.weights);
    if (ray.aim == 0 || ray.aims.spared_variance.empty()) return;
    // Of light L and its weight w, by the densities D of the intake's rays and A of the aimed: the gain is the integral
    // of (L w)^2 (1 / D - 1 / (D + A)), of which this is the estimate from rays of density A.
    const float x = luminance(lux) * Light::irradiance_per_lux;
    ray.aims.spared_variance[term] += x * x * alone / share;
}

template <class Light>
void Gatherer::takeSky(const Ray<Light>& ray, uint32_t path) const {
    const uint32_t term = wantedOf(always_group, path, ray.sum);
    if (term == no_term || rays_.scene().sky_radiance_cd_m2 == glm::vec3(0)) return;
    // An image sky has rays of its own; see sampleSky.
    if (ray.aim && !sky_.empty()) return;
    const uint32_t aim = sky_.empty() && !ray.aims.all.empty() ? ray.aims.of_term[term] : 0;
    add(ray, path, term, missed(ray.options, ray.world, ray.density(path)), aim);
}

// Takes what the leaves along a ray send back, and says whether there are any. Returns the path on which it goes on
// behind them.
template <class Light>
uint32_t Gatherer::throughLeaves(const Ray<Light>& ray, const LeafHits& leaves, LeavesMet& met) const {
    uint32_t path = free_path;
    const auto takeLeaf = [&](const Hit& hit, uint32_t over) {
        const uint32_t found = take(ray, hit, over);
        met.shines = met.shines || emitters_.emitterOf(hit.triangle);
        if (met.through && found != no_index) met.through->push_back({over, found});
    };
    for (const Hit& hit : leaves) {
        met.any = true;
        const uint32_t condition = rays_.triangles()[hit.triangle].condition;
        const Leaf leaf = paths_.leaf(path, ray.from.condition, condition);
        if (leaf == Leaf::Absent) continue;
        const float stopped = rays_.alphaAt(hit.triangle, hit.u, hit.v);
        const uint32_t chance = hash(hash(ray.options.seed, ray.from.id), ray.options.first_ray + ray.i);
        if (stopped < 1 && unitFloat(hash(chance, hit.triangle)) >= stopped) continue;
        if (ray.links && !ray.forDoors()) ray.links->doors.push_back(condition / 2);
        if (leaf == Leaf::There) {
            if (path != free_path || !ray.forDoors()) takeLeaf(hit, path);
            return no_path;
        }
        if (const uint32_t reflecting = paths_.with(path, condition); reflecting != no_path) takeLeaf(hit, reflecting);
        path = paths_.with(path, condition ^ 1);
        if (path == no_path) return no_path;
    }
    return path;
}

uint32_t Gatherer::modelReceiverAt(const Hit& hit, uint32_t chance) const {
    const LevelTriangle& triangle = rays_.triangles()[hit.triangle];
    if (triangle.model == no_model) return no_index;
    if (hit.back && !rays_.scene().materials[triangle.material].double_sided) return no_index;
    const uint32_t found = models_->pick(triangle.model, rays_.pointOn(hit.triangle, hit.u, hit.v),
                                         hit.back ? -triangle.normal : triangle.normal, chance);
    return found == no_index ? no_index : static_cast<uint32_t>(texels_.size()) + found;
}

// Takes the light of the surface at a ray's end. Returns the receiver that it read.
template <class Light>
uint32_t Gatherer::take(const Ray<Light>& ray, const Hit& hit, uint32_t path) const {
    // Emitters have rays of their own; see sampleEmitters.
    if (const Emitter* e = emitters_.emitterOf(hit.triangle); !ray.aim && e && (!hit.back || e->double_sided)) {
        const float cos_emitter = std::abs(glm::dot(ray.world, e->normal));
        const float by_area = static_cast<float>(ray.options.emitter_samples) *
                              emitters_.pdf(emitters_.cellAt(ray.origin), *e, hit.distance_m, cos_emitter);
        const float by_hit = ray.density(path);
        if (const uint32_t term = wantedOf(e->group, path, ray.sum); term != no_term)
            ray.batch.addLater(term, e->radiance_cd_m2 * (ray.alone(path) * by_hit / (by_hit + by_area)));
    }
    uint32_t found = receiverOf(unwrap_, texels_, hit);
    if (found == no_index && !models_->empty())
        found = modelReceiverAt(hit, hash(hash(ray.options.seed, ray.from.id), ray.options.first_ray + ray.i));
    if (found == no_index) return no_index;
    if (ray.links && path == free_path) ray.links->hits[ray.i] = found;
    if (ray.links && path != free_path) ray.links->through_doors.push_back({found, path});
    if (!ray.outgoing) return found;
    ray.outgoing->prefetch(found);
    ray.batch.readLater(found, path);
    return found;
}

// The innermost work of a bake: once for every ray and every term at its end.
template <class Light>
void Gatherer::takeFrom(const Ray<Light>& ray, uint32_t receiver, uint32_t path) const {
    const bool as_it_is = path == free_path && ray.from.condition == no_condition;
    const float alone = ray.alone(path);
    const uint32_t only = ray.aim != 0 ? ray.aims.all[ray.aim - 1].group : shared_guide;
    const uint16_t* const aim_of = ray.aims.all.empty() ? nullptr : ray.aims.of_term.data();
    TermAccumulator<Light>& sum = ray.sum;
    for (const TermLight& light : ray.outgoing->row(receiver)) {
        if (only != shared_guide && paths_.group(light.term) != only) continue;
        const uint32_t found = as_it_is ? light.term : paths_.moved(light.term, path, ray.from.condition);
        if (found == no_term) continue;
        const uint32_t term = sum.into(found);
        if (term == no_term) continue;
        const uint32_t aim = aim_of ? aim_of[term] : 0;
        if (aim != 0)
            add(ray, path, term, light.value(), aim);
        else if (ray.aim == 0)
            sum[term].add(light.value() * alone, ray.weights);
    }
}

// The sky's radiance along a ray that hit nothing, times its share of the two ways to find it.
glm::vec3 Gatherer::missed(const GatherOptions& options, glm::vec3 world, float density) const {
    const glm::vec3 radiance = skyRadiance(rays_.scene(), world);
    if (sky_.empty()) return radiance;
    const float by_sky = sky_.density(radiance, options.emitter_samples);
    return radiance * (density / (density + by_sky));
}

template <class Light>
void Gatherer::sampleSky(const GatherFrom& from, const GatherOptions& options, TermAccumulator<Light>& sum) const {
    if (!options.wanted_in_group.empty() && options.wanted_in_group[always_group] == 0) return;
    for (const auto part : {SkySampler::Peaks, SkySampler::Rest}) {
        const uint32_t seed = hash(options.seed ^ (part == SkySampler::Rest ? 0x3c6ef372u : 0x78dde6e4u), from.id);
        const uint32_t samples = sky_.samplesOf(part, options.emitter_samples);
        for (uint32_t i = 0; i < samples; ++i) {
            const uint32_t index = firstSample(options, samples) + i;
            const SamplePoint& origin = from.points[(index + seed) % from.points.size()];
            const SkySample s = sky_.sample(part, sequence2d(index, seed));
            const glm::vec3 d = toTangent(origin, s.direction);
            const float weight = Light::Intake::weight(d),
                        by_sky = sky_.density(s.radiance_cd_m2, options.emitter_samples);
            if (!(by_sky > 0) || !(weight > 0)) continue;
            const auto weights = Light::weightsOf(d);
            forEachWay(rays_, paths_, from.condition, from.ignored, origin.position_m, s.direction, far_away_m,
                       [&](float passed, uint32_t path) {
                           const float by_ray =
                               static_cast<float>(options.raysOver(path)) * weight / Light::Intake::total;
                           if (const uint32_t term = wantedOf(always_group, path, sum); term != no_term)
                               sum[term].add(s.radiance_cd_m2 * (passed * weight / (by_sky + by_ray)), weights);
                       });
        }
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

template <class Light>
void Gatherer::sampleEmitters(const GatherFrom& from, const GatherOptions& options, TermAccumulator<Light>& sum) const {
    const auto samples = static_cast<float>(options.emitter_samples);
    const uint32_t any_point = hash(options.seed, from.id);
    // Each of the receiver's points gets each part of the group's emitters, in turns: they may be shadowed differently.
    const auto points = static_cast<uint32_t>(from.points.size());
    const uint32_t rounds_for_all = points / std::gcd(points, options.emitter_samples);
    const uint32_t turn = options.first_ray / std::max(options.rays, 1u) / rounds_for_all;
    for (uint32_t i = 0; i < options.emitter_samples; ++i) {
        const uint32_t index = firstSample(options, options.emitter_samples) + i;
        const SamplePoint& origin = from.points[(index + any_point) % from.points.size()];
        for (const auto& range : emitters_.groups(emitters_.cellAt(origin.position_m))) {
            if (!options.wanted_in_group.empty() && options.wanted_in_group[range.group] == 0) continue;
            // Seeded by the group alone, not by its place in a list: other sets do not change its noise.
            const uint32_t seed = hash(hash(options.seed ^ 0x5bd1e995u, from.id), range.identity);
            const uint32_t stratum = (i + turn) % options.emitter_samples;
            const float choice = (static_cast<float>(stratum) + unitFloat(hash(seed, index))) / samples;
            const EmitterSample s = emitters_.sample(range, origin.position_m, choice, sequence2d(index, seed));
            const glm::vec3 d = toTangent(origin, s.direction);
            if (!(s.pdf > 0) || !(Light::Intake::weight(d) > 0)) continue;
            if (from.ignored != no_model && rays_.triangles()[s.triangle].model == from.ignored) continue;
            const float alpha = rays_.alphaAt(s.triangle, s.at.x, s.at.y);  // rays that hit it pass through the rest
            if (!(alpha > 0)) continue;
            const float weight = Light::Intake::weight(d), by_area = samples * s.pdf;
            const uint32_t target = rays_.triangles()[s.triangle].condition;
            forEachWay(rays_, paths_, from.condition, from.ignored, origin.position_m, s.direction,
                       shadowEnd(s.distance_m), [&](float passed, uint32_t way) {
                           const uint32_t path = onto(way, from.condition, target);
                           const uint32_t term = wantedOf(range.group, path, sum);
                           const float by_hit =
                               static_cast<float>(options.raysOver(path)) * weight / Light::Intake::total;
                           if (term != no_term)
                               sum[term].add(s.radiance_cd_m2 * (alpha * passed * weight / (by_area + by_hit)),
                                             Light::weightsOf(d));
                       });
        }
    }
}

template void Gatherer::gather(const GatherFrom&, const GatherOptions&, const SparseLight*, TermAccumulator<Gathered>&,
                               GatherLinks*, const DoorAims&) const;
template void Gatherer::gather(const GatherFrom&, const GatherOptions&, const SparseLight*,
                               TermAccumulator<ProbeLight>&, GatherLinks*, const DoorAims&) const;

}  // namespace dimmer::cook
