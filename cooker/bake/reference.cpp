#include <bake/reference.h>

#include <bake/punctual.h>
#include <bake/sampling.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr float start_offset_m = 2e-4f;
constexpr float far_m = 1e30f;
constexpr int roulette_after = 3, vertices_max = 256;

}  // namespace

// A counter-based random stream of one path (hashes of path and dimension): no low-discrepancy set, so that samples are
// independent and the standard error can be trusted.
struct ReferenceTracer::Path {
    uint32_t seed;
    uint32_t dimension = 0;
    float next() { return unitFloat(hash(seed, dimension++)); }
    glm::vec2 next2() {
        const float x = next();
        return {x, next()};
    }
    uint32_t nextBits() { return hash(seed, dimension++); }
};

ReferenceTracer::ReferenceTracer(const RayScene& rays) : rays_(rays) {
    area_light_of_.assign(rays.triangles().size(), UINT32_MAX);
    float sum = 0;
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
        const Material& material = rays.scene().materials[rays.triangles()[t].material];
        if (material.emission_cd_m2 == glm::vec3(0)) continue;
        const glm::vec3 a = rays.corner(t, 0);
        const float area = 0.5f * glm::length(glm::cross(rays.corner(t, 1) - a, rays.corner(t, 2) - a));
        const float power = area * luminance(material.emission_cd_m2);
        area_light_of_[t] = static_cast<uint32_t>(area_lights_.size());
        sum += power;
        area_lights_.push_back({t, area, sum, power});
    }
    for (AreaLight& l : area_lights_) {
        l.cumulative /= sum;
        l.chance /= sum;
    }
}

glm::vec3 ReferenceTracer::weightOf(std::optional<uint32_t> set, const ReferenceOptions& options) const {
    if (!set) return glm::vec3(options.always_weight);
    return *set < options.set_weights.size() ? options.set_weights[*set] : glm::vec3(1);
}

glm::vec3 ReferenceTracer::punctual(glm::vec3 point, glm::vec3 normal, bool stored_only,
                                    const ReferenceOptions& options) const {
    glm::vec3 sum(0);
    for (const PunctualLight& light : rays_.scene().lights) {
        if (light.bake == BakeMode::None || (stored_only && light.bake != BakeMode::Full)) continue;
        const glm::vec3 weight = weightOf(light.light_set, options);
        if (weight == glm::vec3(0)) continue;
        const Illumination lit = illuminate(light, point);
        const float cos_surface = glm::dot(normal, lit.towards_light);
        if (!(cos_surface > 0) || lit.irradiance_lux == glm::vec3(0)) continue;
        const float distance = std::isinf(lit.distance_m) ? far_m : lit.distance_m;
        sum += weight * lit.irradiance_lux * (cos_surface * rays_.transmittance(point, lit.towards_light, distance));
    }
    return sum;
}

float ReferenceTracer::areaPdf(uint32_t triangle, float distance_m, float cos_emitter) const {
    const AreaLight& l = area_lights_[area_light_of_[triangle]];
    return l.chance * distance_m * distance_m / (l.area_m2 * std::max(cos_emitter, 1e-7f));
}

glm::vec3 ReferenceTracer::areaLight(glm::vec3 point, glm::vec3 normal, Path& path,
                                     const ReferenceOptions& options) const {
    if (area_lights_.empty()) return glm::vec3(0);
    const float choice = path.next();
    const glm::vec2 u = path.next2();
    auto it = std::ranges::upper_bound(area_lights_, choice, {}, &AreaLight::cumulative);
    if (it == area_lights_.end()) --it;
    const float root = std::sqrt(u.x);
    const glm::vec3 to_target = rays_.pointOn(it->triangle, root * (1 - u.y), root * u.y) - point;
    const float distance = glm::length(to_target);
    if (!(distance > 0)) return glm::vec3(0);
    const glm::vec3 direction = to_target / distance;
    const LevelTriangle& triangle = rays_.triangles()[it->triangle];
    const Material& material = rays_.scene().materials[triangle.material];
    const float facing = -glm::dot(direction, triangle.normal);
    const float cos_emitter = material.double_sided ? std::abs(facing) : facing;
    const float cos_surface = glm::dot(direction, normal);
    if (!(cos_emitter > 0) || !(cos_surface > 0)) return glm::vec3(0);
    const float by_area = areaPdf(it->triangle, distance, cos_emitter), by_hit = cos_surface / pi;
    const glm::vec3 weight = weightOf(rays_.scene().meshes[triangle.mesh].light_set, options);
    return weight * material.emission_cd_m2 *
           (cos_surface * rays_.transmittance(point, direction, distance * (1 - 1e-4f)) / (by_area + by_hit));
}

// One path's estimate of the stored irradiance at its first point.
glm::vec3 ReferenceTracer::trace(glm::vec3 point, glm::vec3 normal, Path& path, const ReferenceOptions& options) const {
    const Scene& scene = rays_.scene();
    glm::vec3 sum = areaLight(point, normal, path, options);
    glm::vec3 throughput(pi);  // radiance at the next hit to irradiance here, for cosine-distributed rays
    for (int vertex = 0; vertex < vertices_max; ++vertex) {
        glm::vec3 t, b;
        orthonormalBasis(normal, t, b);
        const glm::vec3 d = cosineDirection(path.next2());
        const glm::vec3 direction = t * d.x + b * d.y + normal * d.z;
        const auto hit = rays_.nearest(point, direction, far_m, path.nextBits());
        if (!hit) return sum + throughput * scene.sky_radiance_cd_m2 * options.always_weight;
        const LevelTriangle& triangle = rays_.triangles()[hit->triangle];
        const SceneMesh& mesh = scene.meshes[triangle.mesh];
        const Material& material = scene.materials[triangle.material];
        if (hit->back && !material.double_sided) return sum;
        if (material.emission_cd_m2 != glm::vec3(0)) {
            const float by_hit = d.z / pi;
            const float by_area =
                areaPdf(hit->triangle, hit->distance_m, std::abs(glm::dot(direction, triangle.normal)));
            sum += throughput * weightOf(mesh.light_set, options) * material.emission_cd_m2 *
                   (by_hit / (by_hit + by_area));
        }
        if (mesh.lighting == Lighting::None) return sum;
        normal = hit->back ? -triangle.normal : triangle.normal;
        point = rays_.pointOn(hit->triangle, hit->u, hit->v) + normal * start_offset_m;
        const glm::vec3 rho = material.reflectance(glm::vec3(rays_.surfaceColor(hit->triangle, hit->u, hit->v)));
        throughput *= rho;
        sum += throughput / pi * (punctual(point, normal, false, options) + areaLight(point, normal, path, options));
        if (vertex < roulette_after) continue;
        const float survive = std::min(0.95f, std::max({rho.x, rho.y, rho.z}));
        if (path.next() >= survive) return sum;
        throughput /= survive;
    }
    return sum;
}

ReferenceValue ReferenceTracer::irradiance(glm::vec3 point_m, glm::vec3 normal, const ReferenceOptions& options) const {
    glm::dvec3 mean(0), squares(0);  // Welford
    const glm::vec3 start = point_m + normal * start_offset_m;
    for (uint32_t i = 0; i < options.paths; ++i) {
        Path path{hash(options.seed, i)};
        const glm::dvec3 value(trace(start, normal, path, options));
        const glm::dvec3 step = value - mean;
        mean += step / static_cast<double>(i + 1);
        squares += step * (value - mean);
    }
    const double n = options.paths;
    const glm::dvec3 error = n > 1 ? glm::sqrt(squares / (n * (n - 1))) : glm::dvec3(0);
    return {glm::vec3(mean) + punctual(start, normal, true, options), glm::vec3(error)};
}

}  // namespace dimmer::cook
