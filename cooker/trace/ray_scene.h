// The level as rays see it: an Embree scene over every mesh that affects light.
#pragma once

#include <scene/scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

namespace dimmer::cook {

// A triangle of the level in the one order that all stages share: meshes in scene order, then triangles.
struct LevelTriangle {
    uint32_t mesh = 0;
    uint32_t triangle = 0;  // within the mesh
    uint32_t material = 0;
    glm::vec3 normal{0};  // geometric, unit
};

struct Hit {
    uint32_t triangle = 0;  // into RayScene::triangles()
    float distance_m = 0;
    float u = 0, v = 0;  // barycentric weights of the second and third corner
    bool back = false;   // the side that faces away from the triangle's front was hit
};

// Immutable after construction; every query is thread-safe.
class RayScene {
   public:
    explicit RayScene(const Scene& scene);
    ~RayScene();
    RayScene(const RayScene&) = delete;
    RayScene& operator=(const RayScene&) = delete;

    // The nearest surface that stops the ray. A blended surface stops it with probability alpha, drawn from `seed`;
    // a masked one where its alpha is at or above the cutoff.
    std::optional<Hit> nearest(glm::vec3 origin, glm::vec3 direction, float distance_max_m, uint32_t seed) const;

    // The share of light, 0..1, that passes from `origin` along `direction` for `distance_m`.
    float transmittance(glm::vec3 origin, glm::vec3 direction, float distance_m) const;

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
    float alphaAt(uint32_t triangle, float u, float v) const;

    const Scene& scene_;
    std::vector<LevelTriangle> triangles_;
    std::unique_ptr<Embree> embree_;
    glm::vec3 bounds_min_{0}, bounds_max_{0};
    bool any_transparent_ = false;
};

}  // namespace dimmer::cook
