// The level as rays see it: an Embree scene over every mesh that affects light.
#pragma once

#include <scene/scene.h>
#include <trace/leaf_boxes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

namespace dimmer::cook {

// "Door d stands closed" is condition 2 d, "stands open" 2 d + 1; the other one of a pair is `condition ^ 1`.
inline constexpr uint32_t no_condition = UINT32_MAX;

// Of Scene::models. Rays for a model's probes pass through the model itself.
inline constexpr uint32_t no_model = UINT32_MAX;

// Beyond every level: how far a ray goes that nothing stops.
inline constexpr float far_away_m = 1e30f;

// A triangle of the level in the one order that all stages share: meshes in scene order, then triangles.
struct LevelTriangle {
    uint32_t mesh = 0;
    uint32_t triangle = 0;  // within the mesh
    uint32_t material = 0;
    glm::vec3 normal{0};                // geometric, unit
    uint32_t condition = no_condition;  // of a door's leaf: it is there while this holds
    uint32_t model = no_model;          // that it belongs to
};

// What stops a ray: everything, with every leaf where it stands; or only what is always there.
enum class Surfaces { All, Walls };

// Where shadow rays end, so as not to hit the emitter that they aim at: short of it by more than a hit is rounded, and
// no more than a millimetre until that is far more than a kilometre's rounding, or thin covers would let its light
// through.
inline float shadowEnd(float distance_m) {
    constexpr float share = 1e-4f, most_m = 1e-3f, rounding = 2e-6f;
    return distance_m - std::max(std::min(share * distance_m, most_m), rounding * distance_m);
}

// How far off a surface rays from a point of it start: so far, or further where floats are coarser than that.
inline float liftOff(glm::vec3 point, float least_m) {
    constexpr float share = 4 * std::numeric_limits<float>::epsilon();
    return std::max(least_m, share * std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)}));
}

struct Hit {
    uint32_t triangle = 0;  // into RayScene::triangles()
    float distance_m = 0;
    float u = 0, v = 0;  // barycentric weights of the second and third corner
    bool back = false;   // the side that faces away from the triangle's front was hit
};

// Surfaces of doors' leaves along one ray, nearest first. More than these lie one behind another nowhere that light
// should get through.
struct LeafHits {
    static constexpr uint32_t max = 32;
    uint32_t count = 0;
    union {  // not written before it is used: most rays meet no leaf
        std::array<Hit, max> hits;
    };

    LeafHits() {}

    Hit* begin() { return hits.data(); }
    Hit* end() { return hits.data() + count; }
    const Hit* begin() const { return hits.data(); }
    const Hit* end() const { return hits.data() + count; }
};

// Immutable after construction; every query is thread-safe.
class RayScene {
   public:
    explicit RayScene(const Scene& scene);
    ~RayScene();
    RayScene(const RayScene&) = delete;
    RayScene& operator=(const RayScene&) = delete;

    // The nearest surface that stops the ray. A blended surface stops it with probability alpha, drawn from `seed`;
    // a masked one where its alpha is at or above the cutoff. `ignored`: a model that is not there. `leaves`, when
    // given (with Walls): takes the leaves on the way there, whether they stop light or not; it costs no ray of its
    // own.
    std::optional<Hit> nearest(glm::vec3 origin, glm::vec3 direction, float distance_max_m, uint32_t seed,
                               Surfaces surfaces = Surfaces::All, uint32_t ignored = no_model,
                               LeafHits* leaves = nullptr) const;

    // Whether the front that a ray met lies in one place with the back of something single-sided, as where solids
    // touch. Costs a short ray.
    bool liesOnBack(const Hit& hit, glm::vec3 origin, glm::vec3 direction, Surfaces surfaces = Surfaces::All,
                    uint32_t ignored = no_model) const;

    // How far any light gets along a ray at most: to the nearest surface that lets none of it pass.
    float reach(glm::vec3 origin, glm::vec3 direction, float distance_max_m, Surfaces surfaces) const;

    // The share of light, 0..1, that passes from `origin` along `direction` for `distance_m`. `leaves`: as above, where
    // some does.
    float transmittance(glm::vec3 origin, glm::vec3 direction, float distance_m, Surfaces surfaces = Surfaces::All,
                        uint32_t ignored = no_model, LeafHits* leaves = nullptr) const;

    bool anyLeaf() const { return walls_ != nullptr; }
    // False only where a ray of any length meets no leaf: cheaper than to trace it.
    bool mayMeetLeaf(glm::vec3 origin, glm::vec3 direction) const {
        return anyLeaf() && leaf_boxes_.mayHit(origin, direction, far_away_m);
    }
    // The share of light, 0..1, that a surface stops there.
    float alphaAt(uint32_t triangle, float u, float v) const;

    // Whether any opaque surface stands between.
    bool blocked(glm::vec3 from, glm::vec3 to) const;

    const Scene& scene() const { return scene_; }
    const std::vector<LevelTriangle>& triangles() const { return triangles_; }
    glm::vec3 corner(uint32_t triangle, int i) const;
    glm::vec3 pointOn(uint32_t triangle, float u, float v) const;
    // Base colour (textured) and alpha at a point of a triangle.
    glm::vec4 surfaceColor(uint32_t triangle, float u, float v) const;
    glm::vec3 boundsMin() const { return bounds_min_; }
    glm::vec3 boundsMax() const { return bounds_max_; }

   private:
    struct Embree;
    const Embree& embree(Surfaces surfaces) const;
    struct Way {
        glm::vec3 origin, direction;
        float length_m;
    };
    Hit hitOf(uint32_t triangle, float distance_m, float u, float v, glm::vec3 direction) const;
    // What stops a ray whose first hit, `hit`, may let it pass.
    std::optional<Hit> throughLayers(const Embree& among, const Way& way, Hit hit, uint32_t seed, uint32_t ignored,
                                     LeafHits* leaves) const;
    float throughTransparent(const Embree& among, const Way& way, uint32_t ignored) const;
    void finish(LeafHits& leaves, glm::vec3 direction, float distance_m) const;

    const Scene& scene_;
    std::vector<LevelTriangle> triangles_;
    std::unique_ptr<Embree> all_, walls_;  // the second, with leaves that stop nothing, only where there are doors
    LeafBoxes leaf_boxes_;
    glm::vec3 bounds_min_{0}, bounds_max_{0};
};

}  // namespace dimmer::cook
