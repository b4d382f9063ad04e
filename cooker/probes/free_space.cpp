#include <probes/free_space.h>

#include <bake/sampling.h>
#include <probes/air_box.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

constexpr uint32_t few_rays = 24, many_rays = 192;
constexpr uint32_t tries_per_place = 64;
// Of what touches along one ray; and how far behind a ray goes on.
constexpr int touching_max = 64;
constexpr float past_touching_m = 1e-3f;

// What rays all around a place meet.
class Surroundings {
   public:
    Surroundings(const RayScene& rays, glm::vec3 point_m, uint32_t ignored, float clearance_m)
        : rays_(rays), point_m_(point_m), ignored_(ignored), clearance_m_(clearance_m) {}

    void look(uint32_t begin, uint32_t end) {
        for (uint32_t i = begin; i < end && !is_close_; ++i) {
            const glm::vec3 direction = uniformSphereDirection(sequence2d(i, 1));
            const auto hit = rays_.nearest(point_m_, direction, far_away_m, i, Surfaces::All, ignored_);
            if (!hit) continue;
            nearest_m_ = std::min(nearest_m_, hit->distance_m);
            is_close_ = nearest_m_ < clearance_m_;
            count(*hit, direction, i);
        }
    }
    bool looksOpen() const { return !is_close_ && 4 * backs_ < hits_; }
    float nearestM() const { return nearest_m_; }
    bool isSure() const { return backs_ == 0 && 4 * hits_ >= 3 * few_rays; }

   private:
    // Where a front lies in one place with a back, solids touch, or rooms without a wall's thickness between them: more
    // of the same lies behind, and what ends that tells which it is.
    void count(Hit hit, glm::vec3 direction, uint32_t seed) {
        glm::vec3 from_m = point_m_;
        for (int passed = 0; passed <= touching_max; ++passed) {
            const LevelTriangle& triangle = rays_.triangles()[hit.triangle];
            const bool back = hit.back && !rays_.scene().materials[triangle.material].double_sided;
            // The foot of a door's leaf often lies in the floor's plane, and shows through it from below.
            if (triangle.condition != no_condition && !back) return;
            std::optional<Hit> behind;
            if (!back && rays_.liesOnBack(hit, from_m, direction, Surfaces::All, ignored_)) {
                from_m += direction * (hit.distance_m + liftOff(from_m, past_touching_m));
                behind = rays_.nearest(from_m, direction, far_away_m, seed, Surfaces::All, ignored_);
            }
            if (!behind) {
                ++hits_;
                backs_ += back;
                return;
            }
            hit = *behind;
        }
    }

    const RayScene& rays_;
    glm::vec3 point_m_;
    uint32_t ignored_;
    float clearance_m_;
    float nearest_m_ = far_away_m;
    uint32_t hits_ = 0, backs_ = 0;
    bool is_close_ = false;
};

// After few_rays.
bool staysOpen(Surroundings& around) {
    // Of thousands of places outside of a level, from where most rays meet nothing, some pass by luck.
    if (around.looksOpen() && !around.isSure()) around.look(few_rays, many_rays);
    return around.looksOpen();
}

}  // namespace

bool inTheOpen(const RayScene& rays, glm::vec3 point_m, uint32_t ignored, float clearance_m) {
    Surroundings around(rays, point_m, ignored, clearance_m);
    around.look(0, few_rays);
    return staysOpen(around);
}

bool chosenInTheOpen(const RayScene& rays, glm::vec3 point_m, float near_m, float chance) {
    Surroundings around(rays, point_m, no_model, probe_clearance_m);
    around.look(0, few_rays);
    return chance * around.nearestM() < near_m && staysOpen(around);
}

std::vector<glm::vec3> openPlaces(const RayScene& rays, uint32_t count, uint32_t seed) {
    const Box air = airBox(rays);
    const glm::vec3 low = air.min_m, size = air.max_m - low;
    std::vector<glm::vec3> places;
    for (uint32_t i = 0; places.size() < count && i < tries_per_place * count; ++i) {
        const glm::vec3 p = low + size * sequence3d(i, seed);
        if (inTheOpen(rays, p)) places.push_back(p);
    }
    return places;
}

}  // namespace dimmer::cook
