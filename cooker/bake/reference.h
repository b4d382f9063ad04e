// The reference: a plain path tracer for irradiance at any point. It shares scene and ray tracing with the baker and
// nothing else: no texels, no stored bounces, no links; what it says is the truth up to its own stated noise.
#pragma once

#include <trace/ray_scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

struct ReferenceOptions {
    uint32_t paths = 4096;
    uint32_t seed = 1;
    // Weight of each light set, per channel; 1 where the list is shorter.
    std::vector<glm::vec3> set_weights;
    float always_weight = 1;  // 0 leaves out all always-on light
};

struct ReferenceValue {
    glm::vec3 irradiance_lux{0};
    glm::vec3 standard_error_lux{0};
};

// Thread-safe. The component that a pack stores: indirect light, and direct light of emitters, the sky and lights baked
// with BakeMode::Full. Doors stand as `rays` has them. Emitters and lights by next-event estimation at every vertex
// (emitters combined with hits by the balance heuristic), Russian roulette after three bounces.
class ReferenceTracer {
   public:
    explicit ReferenceTracer(const RayScene& rays);
    ReferenceValue irradiance(glm::vec3 point_m, glm::vec3 normal, const ReferenceOptions& options) const;

   private:
    struct Path;
    struct AreaLight {
        uint32_t triangle;
        float area_m2;
        float cumulative;  // chance up to and including this one
        float chance;
    };
    glm::vec3 weightOf(std::optional<uint32_t> set, const ReferenceOptions& options) const;
    glm::vec3 punctual(glm::vec3 point, glm::vec3 normal, bool stored_only, const ReferenceOptions& options) const;
    glm::vec3 areaLight(glm::vec3 point, glm::vec3 normal, Path& path, const ReferenceOptions& options) const;
    glm::vec3 trace(glm::vec3 point, glm::vec3 normal, Path& path, const ReferenceOptions& options) const;
    float areaPdf(uint32_t triangle, float distance_m, float cos_emitter) const;

    const RayScene& rays_;
    std::vector<AreaLight> area_lights_;
    std::vector<uint32_t> area_light_of_;  // per level triangle
};

}  // namespace dimmer::cook
