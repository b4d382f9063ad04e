// The reference: a plain path tracer for irradiance at any point. It shares scene and ray tracing with the baker and
// nothing else: no texels, no stored bounces, no links; what it says is the truth up to its own stated noise.
#pragma once

#include <bake/reference_sky.h>
#include <trace/ray_scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

namespace dimmer::cook {

// How far off a surface paths start, at least: liftOff().
inline constexpr float path_offset_m = 2e-4f;

// Which light is asked for.
struct ReferenceOptions {
    uint32_t seed = 1;
    // Weight of each light set, per channel; 1 where the list is shorter.
    std::vector<glm::vec3> set_weights;
    float always_weight = 1;  // 0 leaves out all always-on light
};

// The same for one light set alone, without always-on light.
ReferenceOptions onlySet(uint32_t set, size_t set_count, uint32_t seed = 1);

struct ReferenceValue {
    glm::vec3 irradiance_lux{0};
    glm::vec3 standard_error_lux{0};
    // Of the luminance; the channels share their paths, so it does not follow from theirs.
    float luminance_error_lux = 0;
};

// Where irradiance is asked for. On a surface with a normal of its own (of a normal map, say), what lies below that
// surface is dark, as it is for what a pack stores: `surface` is the surface's normal. In the open it is zero, and
// everything that the normal's hemisphere sees counts.
struct ReferencePoint {
    glm::vec3 position_m, normal;
    glm::vec3 surface{0};
};

// Running mean and variance over paths (Welford 1962) of red, green, blue and luminance.
class ReferenceEstimate {
   public:
    void add(glm::vec3 irradiance_lux);
    uint32_t paths() const { return paths_; }
    ReferenceValue value() const;

   private:
    glm::dvec4 mean_{0}, squares_{0};
    uint32_t paths_ = 0;
};

// Thread-safe. The component that a pack stores: indirect light, and direct light of emitters, the sky and lights baked
// with BakeMode::Full. Doors stand as `rays` has them. Paths with next-event estimation at every vertex: emitters and
// an image sky combined with hits and misses by the balance heuristic (Veach 1995), lamps picked by what they would do
// unshadowed. What a lamp lights close by is small and bright, and paths rarely find it: so the lamp shines at random
// too, and where that falls is connected to the vertex, combined with the paths' own hits likewise. Russian roulette
// after three bounces. Unbiased.
class ReferenceTracer {
   public:
    ReferenceTracer(const RayScene& rays, const ReferenceOptions& options);

    ReferenceValue irradiance(const ReferencePoint& point, uint32_t paths) const;
    // Goes on where `estimate` of the same point stands: the outcome depends on the sum of paths alone.
    void refine(ReferenceEstimate& estimate, const ReferencePoint& point, uint32_t paths) const;
    // The same of the light that this one finds and `other` does not, path by path: both have the same random numbers
    // where their seeds are the same, so that the noise of what both find cancels.
    void refineDifference(ReferenceEstimate& estimate, const ReferenceTracer& other, const ReferencePoint& point,
                          uint32_t paths) const;

   private:
    struct Path;
    struct Vertex;
    struct Start;
    // Sources of one kind as arrays, so that weighing all of them is one vectorised loop.
    struct Sources {
        std::vector<float> x, y, z, power, least_distance2;
        size_t size() const { return x.size(); }
        void add(glm::vec3 position, float source_power, float least_distance_squared);
    };
    struct AreaLight {
        uint32_t triangle;
        float area_m2;
        glm::vec3 radiance_cd_m2;  // weighted
    };
    struct Light {
        uint32_t index;  // into Scene::lights
        glm::vec3 weight;
    };
    static float weigh(const Sources& sources, glm::vec3 point, std::vector<float>& weights);

    glm::vec3 weightOf(std::optional<uint32_t> set) const;
    glm::vec3 fromLight(const Light& light, const Vertex& vertex) const;
    glm::vec3 directPart(const Vertex& vertex) const;
    glm::vec3 punctual(const Vertex& vertex, const Vertex& from, float by_hit, Path& path) const;
    glm::vec3 lampBounce(const Vertex& vertex, Path& path) const;
    float lampPdf(const Vertex& from, uint32_t lamp, const Vertex& lit) const;
    std::optional<Vertex> vertexAt(const Hit& hit, glm::vec3 direction) const;
    glm::vec3 areaLight(const Vertex& vertex, Path& path) const;
    glm::vec3 skyLight(const Vertex& vertex, Path& path) const;
    float areaPdf(const Vertex& vertex, uint32_t area_light, float distance_m, float cos_emitter) const;
    glm::vec3 trace(Vertex vertex, Path& path) const;
    Start startAt(const ReferencePoint& point) const;
    glm::vec3 tracePath(const Start& start, uint32_t number, std::vector<float>& weights) const;

    const RayScene& rays_;
    ReferenceOptions options_;
    ReferenceSky sky_;
    std::vector<Light> suns_, lamps_;  // directional, and those with a place; only what shines
    Sources lamp_sources_, area_sources_;
    std::vector<AreaLight> area_lights_;
    std::vector<uint32_t> area_light_of_;  // per level triangle
};

}  // namespace dimmer::cook
