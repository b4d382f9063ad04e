#include <probes/free_space.h>

#include <bake/sampling.h>

namespace dimmer::cook {
namespace {

constexpr uint32_t rays_per_test = 24;
constexpr uint32_t tries_per_place = 64;

}  // namespace

bool inTheOpen(const RayScene& rays, glm::vec3 point_m, uint32_t ignored, float clearance_m) {
    uint32_t hits = 0, backs = 0;
    for (uint32_t i = 0; i < rays_per_test; ++i) {
        const glm::vec3 direction = uniformSphereDirection(sequence2d(i, 1));
        const auto hit = rays.nearest(point_m, direction, far_away_m, i, Surfaces::All, ignored);
        if (!hit) continue;
        if (hit->distance_m < clearance_m) return false;
        ++hits;
        backs += hit->back && !rays.scene().materials[rays.triangles()[hit->triangle].material].double_sided;
    }
    return hits > 0 && 4 * backs < hits;
}

std::vector<glm::vec3> openPlaces(const RayScene& rays, uint32_t count, uint32_t seed) {
    const glm::vec3 low = rays.boundsMin(), size = rays.boundsMax() - low;
    std::vector<glm::vec3> places;
    for (uint32_t i = 0; places.size() < count && i < tries_per_place * count; ++i) {
        const glm::vec3 p = low + size * sequence3d(i, seed);
        if (inTheOpen(rays, p)) places.push_back(p);
    }
    return places;
}

}  // namespace dimmer::cook
