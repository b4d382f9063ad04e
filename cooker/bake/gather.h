// One gather of the light that arrives at a receiver, shared by every term: what a ray hits does not depend on which
// light is asked about, so each ray is traced once and brings home the light of all terms found at its end. A ray that
// meets a door's leaf ends there and goes on as well, so that one ray serves the open and the closed door.
#pragma once

#include <bake/door_guides.h>
#include <bake/emitters.h>
#include <bake/light_grid.h>
#include <bake/links.h>
#include <bake/ray_ends.h>
#include <bake/sampling.h>
#include <bake/sky.h>
#include <bake/sparse_light.h>
#include <charts/texels.h>
#include <models/model_receivers.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

namespace dimmer::cook {

// The tilt of Gathered's four normals: cosine and sine. The mean cosine of all normals within 60 degrees.
inline constexpr float tilt_cos = 0.75f, tilt_sin = 0.66143783f;

// How receivers take light in: density of rays = weight / total. A surface: by the cosine to its normal, +Z.
struct SurfaceIntake {
    static constexpr float total = std::numbers::pi_v<float>;
    static glm::vec3 direction(glm::vec2 u) { return cosineDirection(u); }
    static float weight(glm::vec3 d) { return d.z; }
};
// A probe: from all around alike, in the axes of the world.
struct ProbeIntake {
    static constexpr float total = 4 * std::numbers::pi_v<float>;
    static glm::vec3 direction(glm::vec2 u) { return uniformSphereDirection(u); }
    static float weight(glm::vec3) { return 1; }
};

// Light of one term at one receiver.
struct Gathered {
    using Intake = SurfaceIntake;
    // Of irradiance() per what add() is given.
    static constexpr float irradiance_per_lux = 1;
    glm::vec3 irradiance_lux{0};
    // Luminance of the irradiance on normals tilted towards +tangent, +bitangent, -tangent and -bitangent: how
    // irradiance falls off. Light from below the surface is left out. Adds up over contributions.
    glm::vec4 tilted_lux{0};

    // Of light from one direction: on each tilted normal, per unit of irradiance on the surface.
    using Weights = glm::vec4;
    static Weights weightsOf(glm::vec3 direction_tangent);

    void add(glm::vec3 lux, const Weights& weights) {
        irradiance_lux += lux;
        tilted_lux += luminance(lux) * weights;
    }
    Gathered& operator+=(const Gathered& o) {
        irradiance_lux += o.irradiance_lux;
        tilted_lux += o.tilted_lux;
        return *this;
    }
    Gathered operator*(float s) const { return {irradiance_lux * s, tilted_lux * s}; }
    glm::vec3 irradiance() const { return irradiance_lux; }
};

// Light of one term at a probe: radiance in spherical harmonics, as runtime/probes/spherical_harmonics.h orders them,
// cd/m2.
struct ProbeLight {
    using Intake = ProbeIntake;
    static constexpr float irradiance_per_lux = 0.25f;  // a sphere's surface, and its cross-section
    std::array<glm::vec3, 9> radiance{};

    // Of light from one direction: the harmonics, once for each channel of `radiance`.
    using Weights = std::array<float, 27>;
    static Weights weightsOf(glm::vec3 direction);

    // `lux`: on a surface that faces the light.
    void add(glm::vec3 lux, const Weights& weights);
    ProbeLight& operator+=(const ProbeLight& o) {
        for (size_t i = 0; i < 9; ++i) radiance[i] += o.radiance[i];
        return *this;
    }
    ProbeLight operator*(float s) const {
        ProbeLight out;
        for (size_t i = 0; i < 9; ++i) out.radiance[i] = radiance[i] * s;
        return out;
    }
    // The mean over all normals, lux: a quarter of what passes through a unit sphere's centre.
    glm::vec3 irradiance() const { return radiance[0] * (0.5f * std::sqrt(std::numbers::pi_v<float>)); }
    glm::vec3 irradiance(glm::vec3 normal) const;
};

struct GatherOptions {
    uint32_t rays = 64;            // by the receiver's intake, shared out among its sample points
    uint32_t emitter_samples = 4;  // towards each light group's emitters, and towards an image sky
    uint32_t seed = 0;
    uint32_t first_ray = 0;  // where in the receiver's sequence to go on: rounds of one gather are one sequence
    // More rays by the intake, of which only those that may meet a door's leaf are traced, and only light over paths
    // that need a door is taken. Not together with aims or rounds.
    uint32_t door_rays = 0;
    // Per light group, how many of its terms the accumulator wants; emitters of groups with none are not asked, nor is
    // an image sky where that is always-on light. Empty: all are.
    std::span<const uint32_t> wanted_in_group;
    // Where the receiver's rays end, counted like first_ray: known ones are not traced, unknown ones become known.
    // Null: none is remembered. With emitters where others are they are not the same.
    RowEnds* row = nullptr;

    uint32_t raysOver(uint32_t path) const { return path == free_path ? rays : rays + door_rays; }
};

// Rays towards one door and what a light group lights through it, for the terms of that guide.
struct DoorAim {
    uint32_t guide = 0;             // of DoorGuides
    uint32_t group = shared_guide;  // whose light alone it is for
    std::vector<Guide> from_point;  // one per point of the receiver
};

// The aims of a gather; per term the number of its own, from 1, or 0 where it has none; and per aim, how many of its
// terms the accumulator wants: where none is, no ray is aimed.
struct DoorAims {
    std::span<const DoorAim> all = {};
    std::span<const uint16_t> of_term = {};
    std::span<const uint32_t> wanted = {};
    // Per term, added to: by how much the light that aimed rays find would spread a gather's sum more if only rays by
    // the intake looked for it (variance of the luminance of irradiance, lux^2). Empty: nobody asks.
    std::span<float> spared_variance = {};
};

// The face of points that lie on none: probes.
inline constexpr uint32_t no_face = UINT32_MAX;

// Texels from half a cell of the grid of lights on: their points lie in several.
inline constexpr float wide_texel_m2 = 0.25f * LightGrid::cell_m * LightGrid::cell_m;

// Where a gather starts: points that share its rays evenly, and what seeds its sample sequence.
struct GatherFrom {
    std::span<const SamplePoint> points;
    uint32_t id = 0;
    uint32_t condition = no_condition;  // under which the receiver is there: a leaf's
    uint32_t ignored = no_model;        // a model that its rays pass through
    bool wide = false;                  // points may lie metres apart: not all get the same lights
    uint32_t texel = no_index;          // that the points are all of
};

// What the rays of a gather found, for going there again.
struct GatherLinks {
    std::span<uint32_t> hits;         // per ray: the receiver that it hit over the free path, or no_index
    std::vector<Link> through_doors;  // over all other paths
    std::vector<uint32_t> doors;      // that rays met, once for each ray
};

// Rays per aim of a gather: an eighth of a round's.
inline constexpr uint32_t aimed_rays = 4;

// Thread-safe: gather() only reads. Light: Gathered for surfaces, ProbeLight for probes.
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
          guides_(std::make_shared<const DoorGuides>(rays)),
          models_(std::make_shared<const ModelReceivers>(rays)) {}
    // The same over other paths.
    Gatherer(const Gatherer& other, const DoorPaths& paths)
        : rays_(other.rays_),
          unwrap_(other.unwrap_),
          texels_(other.texels_),
          emitters_(other.emitters_),
          paths_(paths),
          sky_(other.sky_),
          guides_(other.guides_),
          models_(other.models_) {}

    // Adds to `sum` what comes straight from emitters and the sky, and, when given, the radiance `outgoing` of the
    // receivers that rays hit; of both, what `sum` wants. `links`, when given, takes where the rays ended.
    // `aims`: guides that get `aimed_rays` each besides. Unbiased: emitters are found by area and by hit, an image sky
    // by its own density and by miss, what surfaces and a constant sky send through an aimed door by its rays and all
    // others, weighted by the balance heuristic (Veach 1995).
    template <class Light>
    void gather(const GatherFrom& from, const GatherOptions& options, const SparseLight* outgoing,
                TermAccumulator<Light>& sum, GatherLinks* links, const DoorAims& aims = {}) const;
    DoorAim aimAt(const GatherFrom& from, uint32_t guide) const;
    // Of the term's one door; no_guide for the others.
    uint32_t guideOf(uint32_t term) const;

    // Texels, then the receivers of models.
    size_t receiverCount() const { return texels_.size() + models_->size(); }
    float areaM2(size_t receiver) const {
        return receiver < texels_.size() ? texels_.area_m2[receiver] : models_->areaM2(receiver - texels_.size());
    }
    glm::vec3 reflectance(size_t receiver) const {
        return receiver < texels_.size() ? texels_.reflectance[receiver]
                                         : models_->reflectance(receiver - texels_.size());
    }
    // `points`: keeps them for the result, replaced.
    GatherFrom at(size_t receiver, std::vector<SamplePoint>& points) const {
        if (receiver >= texels_.size()) {
            const size_t i = receiver - texels_.size();
            return {models_->points(i), static_cast<uint32_t>(receiver), no_condition, models_->model(i), true};
        }
        points.clear();
        for (uint32_t i = 0; i < texels_.sampleCount(receiver); ++i)
            points.push_back(samplePoint(rays_, unwrap_, texels_, receiver, i));
        return {points,   static_cast<uint32_t>(receiver),           conditionOf(receiver),
                no_model, texels_.area_m2[receiver] > wide_texel_m2, static_cast<uint32_t>(receiver)};
    }
    // no_condition but for the texels of doors' leaves.
    uint32_t conditionOf(size_t receiver) const {
        if (receiver >= texels_.size()) return no_condition;
        return rays_.triangles()[unwrap_.faces[texels_.face(receiver)].triangle].condition;
    }

    // Of a unit direction of the world, in the frame that the point's light is kept in; a probe's is the world's.
    glm::vec3 toTangent(const SamplePoint& point, glm::vec3 world) const;
    TangentFrame frameOf(const SamplePoint& point) const;
    // A probe; `id` seeds its sequence, `ignored` is the model that it lights.
    static GatherFrom atProbe(const SamplePoint& point, uint32_t id, uint32_t ignored = no_model) {
        return {{&point, 1}, id, no_condition, ignored};
    }
    // The receiver that a ray reads which hit a model; no_index for what has no light. `chance` draws among several.
    uint32_t modelReceiverAt(const Hit& hit, uint32_t chance) const;

    const RayScene& rays() const { return rays_; }
    const Unwrap& unwrap() const { return unwrap_; }
    const Texels& texels() const { return texels_; }
    const DoorPaths& paths() const { return paths_; }
    const ModelReceivers& models() const { return *models_; }

   private:
    struct AimShares;
    struct LeavesMet;
    template <class Light>
    struct Ray;
    template <class Light>
    struct Batch;
    template <class Light>
    uint32_t throughLeaves(const Ray<Light>& ray, const LeafHits& leaves, LeavesMet& met) const;
    template <class Light>
    uint32_t take(const Ray<Light>& ray, const Hit& hit, uint32_t path) const;
    template <class Light>
    void takeFrom(const Ray<Light>& ray, uint32_t receiver, uint32_t path) const;
    template <class Light>
    uint32_t wantedOf(uint32_t group, uint32_t path, const TermAccumulator<Light>& sum) const;
    template <class Light>
    bool brings(std::span<const PathEnd> ends, const GatherFrom& from, const SparseLight* outgoing,
                const TermAccumulator<Light>& sum) const;
    template <class Light>
    void takeSky(const Ray<Light>& ray, uint32_t path) const;
    template <class Light>
    uint32_t follow(const Ray<Light>& ray, uint32_t seed, std::vector<PathEnd>* through = nullptr) const;
    template <class Light>
    void gatherAimed(const GatherFrom& from, const GatherOptions& options, const SparseLight* outgoing,
                     TermAccumulator<Light>& sum, const DoorAims& aims, size_t aim, Batch<Light>& batch) const;
    template <class Light>
    float shareOf(const Ray<Light>& ray, uint32_t path, uint32_t aim) const;
    template <class Light>
    void add(const Ray<Light>& ray, uint32_t path, uint32_t term, glm::vec3 radiance, uint32_t aim) const;
    uint32_t onto(uint32_t path, uint32_t own, uint32_t target) const;
    glm::vec3 missed(const GatherOptions& options, glm::vec3 world, float density) const;
    template <class Light>
    void sampleEmitters(const GatherFrom& from, const GatherOptions& options, TermAccumulator<Light>& sum) const;
    template <class Light>
    void sampleSky(const GatherFrom& from, const GatherOptions& options, TermAccumulator<Light>& sum) const;

    const RayScene& rays_;
    const Unwrap& unwrap_;
    const Texels& texels_;
    const EmitterSampler& emitters_;
    const DoorPaths& paths_;
    SkySampler sky_;
    // Of the level alone, and shared by gatherers of it: both trace rays of their own.
    std::shared_ptr<const DoorGuides> guides_;
    std::shared_ptr<const ModelReceivers> models_;
};

}  // namespace dimmer::cook
