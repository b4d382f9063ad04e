// One gather of the light that arrives at a receiver, shared by every term: what a ray hits does not depend on which
// light is asked about, so each ray is traced once and brings home the light of all terms found at its end. A ray that
// meets a door's leaf ends there and goes on as well, so that one ray serves the open and the closed door.
#pragma once

#include <bake/door_guides.h>
#include <bake/emitters.h>
#include <bake/sky.h>
#include <bake/sparse_light.h>
#include <charts/texels.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

namespace dimmer::cook {

// The tilt of Gathered's four normals: cosine and sine. The mean cosine of all normals within 60 degrees.
inline constexpr float tilt_cos = 0.75f, tilt_sin = 0.66143783f;

// Light of one term at one receiver.
struct Gathered {
    glm::vec3 irradiance_lux{0};
    // Luminance of the irradiance on normals tilted towards +tangent, +bitangent, -tangent and -bitangent: how
    // irradiance falls off. Light from below the surface is left out. Adds up over contributions.
    glm::vec4 tilted_lux{0};

    void add(glm::vec3 lux, glm::vec3 direction_tangent);
    Gathered& operator+=(const Gathered& o) {
        irradiance_lux += o.irradiance_lux;
        tilted_lux += o.tilted_lux;
        return *this;
    }
    Gathered operator*(float s) const { return {irradiance_lux * s, tilted_lux * s}; }
};

struct GatherOptions {
    uint32_t rays = 64;            // cosine-distributed, shared out among the texel's sample points
    uint32_t emitter_samples = 4;  // towards each light group's emitters, and towards an image sky
    uint32_t seed = 0;
    uint32_t first_ray = 0;  // where in the receiver's sequence to go on: rounds of one gather are one sequence
    // Per light group, how many of its terms the accumulator wants; emitters of groups with none are not asked. Empty:
    // all are.
    std::span<const uint32_t> wanted_in_group;
};

// Rays towards one door and what a light group lights through it, for the terms of that guide.
struct DoorAim {
    uint32_t guide = 0;             // of DoorGuides
    std::vector<Guide> from_point;  // one per point of the receiver
};

// Where a gather starts: points that share its rays evenly, and what seeds its sample sequence.
struct GatherFrom {
    std::span<const SamplePoint> points;
    uint32_t id = 0;
    uint32_t condition = no_condition;  // under which the receiver is there: a leaf's
};

// What the rays of a gather found, for going there again.
struct GatherLinks {
    struct ThroughDoors {
        uint32_t receiver;
        uint32_t path;
    };
    std::span<uint32_t> hits;                 // per ray: the receiver that it hit over the free path, or no_index
    std::vector<ThroughDoors> through_doors;  // over all other paths
    std::vector<uint32_t> doors;              // that rays met, once for each ray
};

// Rays per aim of a gather: an eighth of a round's.
inline constexpr uint32_t aimed_rays = 4;

// Thread-safe: gather() only reads.
class Gatherer {
   public:
    Gatherer(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const EmitterSampler& emitters,
             const DoorPaths& paths)
        : rays_(rays),
          unwrap_(unwrap),
          texels_(texels),
          emitters_(emitters),
          paths_(paths),
          sky_(rays.scene()),
          guides_(rays) {
        for (uint32_t t = 0; t < paths.termCount(); ++t) guide_of_term_.push_back(guideOf(t));
    }

    // Adds to `sum` what comes straight from emitters and the sky, and, when given, the radiance `outgoing` of the
    // receivers that rays hit; of both, what `sum` wants. `links`, when given, takes where the rays ended.
    // `aims`: guides that get `aimed_rays` each besides. Unbiased: emitters are found by area and by hit, an image sky
    // by its own density and by miss, what surfaces and a constant sky send through an aimed door by its rays and all
    // others, weighted by the balance heuristic (Veach 1995).
    void gather(const GatherFrom& from, const GatherOptions& options, const SparseLight* outgoing,
                TermAccumulator<Gathered>& sum, GatherLinks* links, std::span<const DoorAim> aims = {}) const;
    DoorAim aimAt(const GatherFrom& from, uint32_t guide) const;
    // Of the term's one door; no_guide for the others.
    uint32_t guideOf(uint32_t term) const;

    GatherFrom at(size_t receiver) const {
        return {{&texels_.sample(receiver, 0), texels_.sampleCount(receiver)},
                static_cast<uint32_t>(receiver),
                conditionOf(receiver)};
    }
    // no_condition but for the texels of doors' leaves.
    uint32_t conditionOf(size_t receiver) const {
        return rays_.triangles()[unwrap_.faces[texels_.sample(receiver, 0).face].triangle].condition;
    }

    const RayScene& rays() const { return rays_; }
    const Unwrap& unwrap() const { return unwrap_; }
    const Texels& texels() const { return texels_; }
    const DoorPaths& paths() const { return paths_; }
    const EmitterSampler& emitters() const { return emitters_; }

   private:
    struct Ray;
    uint32_t throughLeaves(const Ray& ray, float distance_m) const;
    void take(const Ray& ray, const Hit& hit, uint32_t path) const;
    void takeSky(const Ray& ray, uint32_t path) const;
    void follow(const Ray& ray, uint32_t seed) const;
    void gatherAimed(const GatherFrom& from, const GatherOptions& options, const SparseLight* outgoing,
                     TermAccumulator<Gathered>& sum, std::span<const DoorAim> aims, size_t aim) const;
    float shareOf(const Ray& ray, uint32_t term) const;
    uint32_t onto(uint32_t path, uint32_t own, uint32_t target) const;
    glm::vec3 missed(const GatherOptions& options, glm::vec3 world, float cos_surface) const;
    void sampleEmitters(const GatherFrom& from, const GatherOptions& options, TermAccumulator<Gathered>& sum) const;
    void sampleSky(const GatherFrom& from, const GatherOptions& options, TermAccumulator<Gathered>& sum) const;

    const RayScene& rays_;
    const Unwrap& unwrap_;
    const Texels& texels_;
    const EmitterSampler& emitters_;
    const DoorPaths& paths_;
    SkySampler sky_;
    DoorGuides guides_;
    std::vector<uint32_t> guide_of_term_;
};

}  // namespace dimmer::cook
