#include <bake/reference.h>

#include <bake/punctual.h>
#include <bake/sampling.h>
#include <bake/sky.h>
#include <scene/emission.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace dimmer::cook {
namespace {

// Roulette ends paths; the limit is for nothing but a bound (0.99^4096, the largest reflectance's share, is 1e-18).
constexpr int roulette_after = 3, vertices_max = 4096;
// Shadow rays to lamps per vertex; with no more lamps than that, each gets its own.
constexpr uint32_t lamp_rays = 4;
constexpr uint32_t none = UINT32_MAX;

// The index at which the cumulated weights pass `target`.
uint32_t pick(const std::vector<float>& weights, float target) {
    uint32_t i = 0;
    for (; i + 1 < weights.size() && target >= weights[i]; ++i) target -= weights[i];
    return i;
}

// Where a lamp that is no spot shines besides its beam: all around.
size_t besidesBeam(const PunctualLight& light) {
    return light.type == LightType::Spot ? 0 : 1;
}

// Even over one of its cones or, of what is no spot, all around; each of these as often as the others.
glm::vec3 lampDirection(const PunctualLight& light, glm::vec2 u) {
    const BeamCones beam = beamCones(light);
    const size_t choices = beam.cosines.size() + besidesBeam(light);
    u.x *= static_cast<float>(choices);
    const size_t choice = std::min(static_cast<size_t>(u.x), choices - 1);
    u.x -= static_cast<float>(choice);
    if (choice == beam.cosines.size()) return uniformSphereDirection(u);
    const glm::vec3 d = uniformCapDirection(u, beam.cosines[choice]);
    glm::vec3 t, b;
    orthonormalBasis(beam.axis, t, b);
    return t * d.x + b * d.y + beam.axis * d.z;
}

// The density per steradian with which lampDirection() finds a direction.
float lampDirectionPdf(const PunctualLight& light, glm::vec3 away) {
    const BeamCones beam = beamCones(light);
    const size_t besides = besidesBeam(light);
    float sum = static_cast<float>(besides) / (4 * pi);
    for (const float cosine : beam.cosines)
        if (glm::dot(beam.axis, away) >= cosine) sum += 1 / (2 * pi * (1 - cosine));
    return sum / static_cast<float>(beam.cosines.size() + besides);
}

// Back the way that the ray came, where nothing can stand: straight up is beyond the other surface where two meet at an
// acute angle. Grazing rays stay nearer to the surface than others, and no nearer than rounding allows.
glm::vec3 offSurface(const Hit& hit, glm::vec3 direction, glm::vec3 point, glm::vec3 normal) {
    constexpr float back_max_m = 0.01f;
    const float offset_m = liftOff(point, path_offset_m), least_m = liftOff(point, 0);
    const float cosine = std::max(-glm::dot(direction, normal), 1e-6f);
    const float back_m = std::min({offset_m / cosine, hit.distance_m / 2, back_max_m});
    return point - direction * back_m + normal * std::max(0.0f, least_m - back_m * cosine);
}

uint32_t hashOf(glm::vec3 v, uint32_t seed) {
    for (int i = 0; i < 3; ++i) seed = hash(seed, std::bit_cast<uint32_t>(v[i]));
    return seed;
}

}  // namespace

ReferenceOptions onlySet(uint32_t set, size_t set_count, uint32_t seed) {
    ReferenceOptions options{.seed = seed, .set_weights = std::vector<glm::vec3>(set_count), .always_weight = 0};
    options.set_weights[set] = glm::vec3(1);
    return options;
}

void ReferenceEstimate::add(glm::vec3 irradiance_lux) {
    const glm::dvec4 value(irradiance_lux, luminance(irradiance_lux));
    const glm::dvec4 step = value - mean_;
    mean_ += step / static_cast<double>(++paths_);
    squares_ += step * (value - mean_);
}

ReferenceValue ReferenceEstimate::value() const {
    const double n = paths_;
    const glm::dvec4 error = n > 1 ? glm::sqrt(squares_ / (n * (n - 1))) : glm::dvec4(0);
    return {glm::vec3(mean_), glm::vec3(error), static_cast<float>(error.w)};
}

// A counter-based random stream of one path (hashes of path and dimension): no low-discrepancy set, so that samples are
// independent and the standard error can be trusted.
struct ReferenceTracer::Path {
    uint32_t seed;
    std::vector<float>& weights;  // scratch
    uint32_t dimension = 0;
    float next() { return unitFloat(hash(seed, dimension++)); }
    glm::vec2 next2() {
        const float x = next();
        return {x, next()};
    }
    uint32_t nextBits() { return hash(seed, dimension++); }
};

struct ReferenceTracer::Vertex {
    glm::vec3 point{0}, normal{0};
    glm::vec3 reflectance{0};
    glm::vec3 horizon{0};  // what lies below is dark; see ReferencePoint
    // Of a direction to the normal; 0 below either.
    float cosine(glm::vec3 direction) const {
        return glm::dot(direction, horizon) < 0 ? 0 : std::max(0.0f, glm::dot(direction, normal));
    }
    float lamp_weight_sum = 0;  // of the lamps, as seen from here
    float area_weight_sum = 0;  // of the emitters, as seen from here
};

// What all paths from a point have in common.
struct ReferenceTracer::Start {
    Vertex vertex;
    glm::vec3 direct_lux{0};
    uint32_t seed = 0;
};

void ReferenceTracer::Sources::add(glm::vec3 position, float source_power, float least_distance_squared) {
    x.push_back(position.x);
    y.push_back(position.y);
    z.push_back(position.z);
    power.push_back(source_power);
    least_distance2.push_back(least_distance_squared);
}

// Power over squared distance of every source; returns the sum.
float ReferenceTracer::weigh(const Sources& s, glm::vec3 p, std::vector<float>& weights) {
    weights.resize(s.size());
    for (size_t i = 0; i < s.size(); ++i) {
        const float dx = s.x[i] - p.x, dy = s.y[i] - p.y, dz = s.z[i] - p.z;
        weights[i] = s.power[i] / std::max(dx * dx + dy * dy + dz * dz, s.least_distance2[i]);
    }
    return std::accumulate(weights.begin(), weights.end(), 0.0f);
}

ReferenceTracer::ReferenceTracer(const RayScene& rays, const ReferenceOptions& options)
    : rays_(rays), options_(options), sky_(rays.scene(), options.always_weight != 0) {
    const Scene& scene = rays.scene();
    for (uint32_t i = 0; i < scene.lights.size(); ++i) {
        const PunctualLight& light = scene.lights[i];
        const Light entry{i, weightOf(light.light_set)};
        const float power = luminance(light.intensity * entry.weight);
        if (light.bake == BakeMode::None || !(power > 0)) continue;
        if (light.type == LightType::Directional) {
            suns_.push_back(entry);
            continue;
        }
        lamps_.push_back(entry);
        lamp_sources_.add(light.position_m, power, 1e-4f);
    }
    area_light_of_.assign(rays.triangles().size(), none);
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
        const LevelTriangle& triangle = rays.triangles()[t];
        const SceneMesh& mesh = scene.meshes[triangle.mesh];
        const glm::vec3 radiance = emissionOf(scene, mesh, triangle.triangle) * weightOf(mesh.light_set);
        if (!(luminance(radiance) > 0)) continue;
        const glm::vec3 a = rays.corner(t, 0);
        const float area = 0.5f * glm::length(glm::cross(rays.corner(t, 1) - a, rays.corner(t, 2) - a));
        area_light_of_[t] = static_cast<uint32_t>(area_lights_.size());
        area_lights_.push_back({t, area, radiance});
        area_sources_.add(rays.pointOn(t, 1.0f / 3, 1.0f / 3), area * luminance(radiance), area);
    }
}

glm::vec3 ReferenceTracer::weightOf(std::optional<uint32_t> set) const {
    if (!set) return glm::vec3(options_.always_weight);
    return *set < options_.set_weights.size() ? options_.set_weights[*set] : glm::vec3(1);
}

glm::vec3 ReferenceTracer::fromLight(const Light& light, const Vertex& vertex) const {
    const Illumination lit = illuminate(rays_.scene().lights[light.index], vertex.point);
    const float cos_surface = vertex.cosine(lit.towards_light);
    if (!(cos_surface > 0) || lit.irradiance_lux == glm::vec3(0)) return glm::vec3(0);
    const float distance = shadowRayLengthM(lit);
    return light.weight * lit.irradiance_lux *
           (cos_surface * rays_.transmittance(vertex.point, lit.towards_light, distance));
}

// Straight from the lights that are baked in full: without noise.
glm::vec3 ReferenceTracer::directPart(const Vertex& vertex) const {
    glm::vec3 sum(0);
    for (const auto* lights : {&suns_, &lamps_})
        for (const Light& light : *lights)
            if (rays_.scene().lights[light.index].bake == BakeMode::Full) sum += fromLight(light, vertex);
    return sum;
}

// At a vertex that was hit from `from`, with density `by_hit` per square metre.
glm::vec3 ReferenceTracer::punctual(const Vertex& vertex, const Vertex& from, float by_hit, Path& path) const {
    glm::vec3 sum(0);
    for (const Light& sun : suns_) sum += fromLight(sun, vertex);
    // lampBounce() finds this vertex as well.
    const auto share = [&](uint32_t lamp) { return by_hit / (by_hit + lampPdf(from, lamp, vertex)); };
    if (lamps_.size() <= lamp_rays) {
        for (uint32_t i = 0; i < lamps_.size(); ++i) sum += fromLight(lamps_[i], vertex) * share(i);
        return sum;
    }
    const float all = weigh(lamp_sources_, vertex.point, path.weights);
    if (!(all > 0)) return sum;
    // Systematic sampling: `lamp_rays` equal steps through the cumulated weights, one random shift.
    const float step = all / lamp_rays;
    float target = path.next() * step, cumulative = 0;
    for (uint32_t i = 0; i < lamps_.size(); ++i) {
        cumulative += path.weights[i];
        float picked = 0;
        for (; target < cumulative; target += step) ++picked;
        if (picked > 0) sum += fromLight(lamps_[i], vertex) * (share(i) * picked * step / path.weights[i]);
    }
    return sum;
}

// The density per square metre with which lampBounce() from `from` finds the vertex `lit` by this lamp.
float ReferenceTracer::lampPdf(const Vertex& from, uint32_t lamp, const Vertex& lit) const {
    const Sources& s = lamp_sources_;
    const PunctualLight& light = rays_.scene().lights[lamps_[lamp].index];
    const glm::vec3 to_lamp = light.position_m - lit.point, apart = light.position_m - from.point;
    const float distance2 = glm::dot(to_lamp, to_lamp);
    if (!(distance2 > 0)) return 0;
    const glm::vec3 direction = to_lamp / std::sqrt(distance2);
    const float choice = s.power[lamp] / std::max(glm::dot(apart, apart), s.least_distance2[lamp]);
    return choice / from.lamp_weight_sum * std::max(glm::dot(lit.normal, direction), 0.0f) *
           lampDirectionPdf(light, -direction) / distance2;
}

// Light of lamps that reaches `vertex` after one bounce: a lamp is picked, it shines somewhere, and that place is
// connected to the vertex.
glm::vec3 ReferenceTracer::lampBounce(const Vertex& vertex, Path& path) const {
    if (!(vertex.lamp_weight_sum > 0)) return glm::vec3(0);
    weigh(lamp_sources_, vertex.point, path.weights);
    const uint32_t lamp = pick(path.weights, path.next() * vertex.lamp_weight_sum);
    const PunctualLight& light = rays_.scene().lights[lamps_[lamp].index];
    const glm::vec3 away = lampDirection(light, path.next2());
    const auto hit = rays_.nearest(light.position_m + away * lamp_lift_m, away, far_away_m, path.nextBits());
    const auto lit = hit ? vertexAt(*hit, away) : std::nullopt;
    if (!lit) return glm::vec3(0);
    const glm::vec3 to_lit = lit->point - vertex.point;
    const float distance2 = glm::dot(to_lit, to_lit), distance = std::sqrt(distance2);
    if (!(distance > 0)) return glm::vec3(0);
    const glm::vec3 direction = to_lit / distance;
    const float cos_here = vertex.cosine(direction), cos_there = -glm::dot(lit->normal, direction);
    const Illumination there = illuminate(light, lit->point);
    const float cos_lamp = glm::dot(lit->normal, there.towards_light);
    if (!(cos_here > 0) || !(cos_there > 0) || !(cos_lamp > 0)) return glm::vec3(0);
    const float geometry = cos_here * cos_there / distance2;
    return lit->reflectance / pi * lamps_[lamp].weight * there.irradiance_lux *
           (cos_lamp * geometry * rays_.transmittance(vertex.point, direction, shadowEnd(distance)) /
            (geometry / pi + lampPdf(vertex, lamp, *lit)));
}

// The density per steradian with which areaLight() finds a point of an emitter.
float ReferenceTracer::areaPdf(const Vertex& vertex, uint32_t area_light, float distance_m, float cos_emitter) const {
    const Sources& s = area_sources_;
    const glm::vec3 to = glm::vec3(s.x[area_light], s.y[area_light], s.z[area_light]) - vertex.point;
    const float weight = s.power[area_light] / std::max(glm::dot(to, to), s.least_distance2[area_light]);
    return weight / vertex.area_weight_sum * distance_m * distance_m /
           (area_lights_[area_light].area_m2 * std::max(cos_emitter, 1e-7f));
}

glm::vec3 ReferenceTracer::areaLight(const Vertex& vertex, Path& path) const {
    if (!(vertex.area_weight_sum > 0)) return glm::vec3(0);
    const uint32_t chosen = pick(path.weights, path.next() * vertex.area_weight_sum);
    const glm::vec2 on = uniformOnTriangle(path.next2());
    const AreaLight& light = area_lights_[chosen];
    const glm::vec3 to_target = rays_.pointOn(light.triangle, on.x, on.y) - vertex.point;
    const float distance = glm::length(to_target);
    if (!(distance > 0)) return glm::vec3(0);
    const glm::vec3 direction = to_target / distance;
    const LevelTriangle& triangle = rays_.triangles()[light.triangle];
    const Material& material = rays_.scene().materials[triangle.material];
    const float facing = -glm::dot(direction, triangle.normal);
    const float cos_emitter = material.double_sided ? std::abs(facing) : facing;
    const float cos_surface = vertex.cosine(direction);
    if (!(cos_emitter > 0) || !(cos_surface > 0)) return glm::vec3(0);
    const float by_area = areaPdf(vertex, chosen, distance, cos_emitter), by_hit = cos_surface / pi;
    // What is cut out or blended shines by its alpha, as a ray that hits it finds.
    const float shown = rays_.alphaAt(light.triangle, on.x, on.y);
    return light.radiance_cd_m2 *
           (shown * cos_surface * rays_.transmittance(vertex.point, direction, shadowEnd(distance)) /
            (by_area + by_hit));
}

// By the sky's own directions: a sun in the picture is small, and paths hardly ever leave the level towards it.
glm::vec3 ReferenceTracer::skyLight(const Vertex& vertex, Path& path) const {
    if (sky_.empty()) return glm::vec3(0);
    const float choice = path.next();
    const glm::vec3 direction = sky_.sample(choice, path.next2());
    const float cos_surface = vertex.cosine(direction);
    if (!(cos_surface > 0)) return glm::vec3(0);
    const glm::vec3 radiance = skyRadiance(rays_.scene(), direction);
    const float by_sky = sky_.pdf(radiance);
    if (!(by_sky > 0)) return glm::vec3(0);
    return radiance * (options_.always_weight * cos_surface * rays_.transmittance(vertex.point, direction, far_away_m) /
                       (by_sky + cos_surface / pi));
}

// The surface that was hit as the next vertex; empty where it reflects nothing.
std::optional<ReferenceTracer::Vertex> ReferenceTracer::vertexAt(const Hit& hit, glm::vec3 direction) const {
    const LevelTriangle& triangle = rays_.triangles()[hit.triangle];
    const Material& material = rays_.scene().materials[triangle.material];
    if (hit.back && !material.double_sided) return std::nullopt;
    if (rays_.scene().meshes[triangle.mesh].lighting == Lighting::None) return std::nullopt;
    const glm::vec3 normal = hit.back ? -triangle.normal : triangle.normal;
    const glm::vec3 point = rays_.pointOn(hit.triangle, hit.u, hit.v);
    return Vertex{.point = offSurface(hit, direction, point, normal),
                  .normal = normal,
                  .reflectance = material.reflectance(glm::vec3(rays_.surfaceColor(hit.triangle, hit.u, hit.v)))};
}

// One path's estimate of the stored irradiance at its first point, without the noiseless direct part.
glm::vec3 ReferenceTracer::trace(Vertex vertex, Path& path) const {
    const Scene& scene = rays_.scene();
    glm::vec3 sum(0);
    // From radiance at the next hit to irradiance here, for cosine-distributed rays.
    glm::vec3 throughput(pi);
    for (int i = 0; i < vertices_max; ++i) {
        vertex.lamp_weight_sum = weigh(lamp_sources_, vertex.point, path.weights);
        sum += throughput / pi * lampBounce(vertex, path);
        vertex.area_weight_sum = weigh(area_sources_, vertex.point, path.weights);
        sum += throughput / pi * areaLight(vertex, path);
        sum += throughput / pi * skyLight(vertex, path);
        if (i > roulette_after) {
            const float survive = std::clamp(std::max({throughput.x, throughput.y, throughput.z}) / pi, 0.05f, 0.95f);
            if (path.next() >= survive) return sum;
            throughput /= survive;
        }
        glm::vec3 t, b;
        orthonormalBasis(vertex.normal, t, b);
        const glm::vec3 d = cosineDirection(path.next2());
        const glm::vec3 direction = t * d.x + b * d.y + vertex.normal * d.z;
        if (!(vertex.cosine(direction) > 0)) return sum;
        const auto hit = rays_.nearest(vertex.point, direction, far_away_m, path.nextBits());
        const float by_hit = d.z / pi;
        if (!hit) {
            const glm::vec3 radiance = skyRadiance(scene, direction);
            return sum + throughput * radiance * (options_.always_weight * by_hit / (by_hit + sky_.pdf(radiance)));
        }
        const LevelTriangle& triangle = rays_.triangles()[hit->triangle];
        if (hit->back && !scene.materials[triangle.material].double_sided) return sum;
        const float cos_there = std::abs(glm::dot(direction, triangle.normal));
        if (const uint32_t light = area_light_of_[hit->triangle]; light != none)
            sum += throughput * area_lights_[light].radiance_cd_m2 *
                   (by_hit / (by_hit + areaPdf(vertex, light, hit->distance_m, cos_there)));
        auto next = vertexAt(*hit, direction);
        if (!next) return sum;
        throughput *= next->reflectance;
        const float distance2 = std::max(hit->distance_m * hit->distance_m, 1e-12f);
        sum += throughput / pi * punctual(*next, vertex, by_hit * cos_there / distance2, path);
        vertex = *next;
    }
    return sum;
}

ReferenceValue ReferenceTracer::irradiance(const ReferencePoint& point, uint32_t paths) const {
    ReferenceEstimate estimate;
    refine(estimate, point, paths);
    return estimate.value();
}

ReferenceTracer::Start ReferenceTracer::startAt(const ReferencePoint& point) const {
    Start start;
    const bool on_surface = point.surface != glm::vec3(0);
    start.vertex.point =
        point.position_m + (on_surface ? point.surface : point.normal) * liftOff(point.position_m, path_offset_m);
    start.vertex.normal = point.normal;
    start.vertex.horizon = point.surface;
    start.direct_lux = directPart(start.vertex);
    // By place: the errors of two points are independent. Not by state: differences between states have less noise.
    start.seed = hashOf(point.normal, hashOf(point.position_m, options_.seed));
    return start;
}

glm::vec3 ReferenceTracer::tracePath(const Start& start, uint32_t number, std::vector<float>& weights) const {
    Path path{hash(start.seed, number), weights};
    return start.direct_lux + trace(start.vertex, path);
}

void ReferenceTracer::refine(ReferenceEstimate& estimate, const ReferencePoint& point, uint32_t paths) const {
    const Start start = startAt(point);
    std::vector<float> weights;
    for (uint32_t i = 0; i < paths; ++i) estimate.add(tracePath(start, estimate.paths(), weights));
}

void ReferenceTracer::refineDifference(ReferenceEstimate& estimate, const ReferenceTracer& other,
                                       const ReferencePoint& point, uint32_t paths) const {
    const Start here = startAt(point), there = other.startAt(point);
    std::vector<float> weights;
    for (uint32_t i = 0; i < paths; ++i)
        estimate.add(tracePath(here, estimate.paths(), weights) - other.tracePath(there, estimate.paths(), weights));
}

}  // namespace dimmer::cook
