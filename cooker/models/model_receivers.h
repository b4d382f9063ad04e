// Models with light grids as the bounces see them: for each probe a few receivers, one for each of 18 normals spread
// over the sphere. Each stands for what of the surface is near to its probe and normal; its light is gathered there as
// that of texels is, without the model itself. A ray that hits the model picks one of them.
#pragma once

#include <charts/texels.h>
#include <trace/ray_scene.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

inline constexpr size_t receiver_normals = 18;

// The probes that a place of a model reads, and how much of each.
struct NearProbes {
    std::array<uint32_t, 8> number;  // within the model
    std::array<float, 8> share;
};
NearProbes nearProbes(const SceneModel& model, glm::vec3 point_m);

// Where the light of a model's probes is gathered.
struct ProbePlaces {
    // Per probe: a little nearer to the middle of the model than it stands, as far as it takes to be in the open.
    std::vector<glm::vec3> position_m;
    // Per probe, the one whose light it has: its own or, inside of other geometry, the nearest that is in the open;
    // no_index where none of the model's is.
    std::vector<uint32_t> source;
};

// visit(number, triangle) for the level's triangles of a model, in their order. Costs nothing for those of others, of
// which a level may have a thousand times as many.
void forTriangles(const RayScene& rays, uint32_t model, auto&& visit) {
    for (const uint32_t mesh : rays.scene().models[model].meshes)
        for (const LevelTriangle& t : std::ranges::equal_range(rays.triangles(), mesh, {}, &LevelTriangle::mesh))
            visit(static_cast<uint32_t>(&t - rays.triangles().data()), t);
}

class ModelReceivers {
   public:
    // Of the models of the rays' scene (listModels); empty where none stands.
    explicit ModelReceivers(const RayScene& rays);

    bool empty() const { return models_.empty(); }
    size_t size() const { return model_.size(); }
    // One at least; their face is one for receiverFrame().
    std::span<const SamplePoint> points(size_t i) const {
        return std::span(points_).subspan(first_point_[i], first_point_[i + 1] - first_point_[i]);
    }
    uint32_t model(size_t i) const { return model_[i]; }
    float areaM2(size_t i) const { return area_m2_[i]; }
    glm::vec3 reflectance(size_t i) const { return models_[model_[i]].reflectance; }

    // What a ray reads that hits a model at a point of its surface with this normal; no_index where nothing is known.
    // Which one is drawn by `chance`: on average, linear between the probes and between the normals.
    uint32_t pick(uint32_t model, glm::vec3 point_m, glm::vec3 normal, uint32_t chance) const;

    // Over all models' probes, in the order of localGrids().
    const ProbePlaces& places() const { return places_; }
    uint32_t modelOfProbe(uint32_t probe) const { return model_of_probe_[probe]; }

   private:
    friend ProbePlaces probePlaces(const RayScene& rays);
    ModelReceivers(const RayScene& rays, bool with_receivers);
    struct Model {
        uint32_t first_probe = 0, first_receiver = 0;
        std::array<uint32_t, receiver_normals> slots{};  // of the normals that the model's surface is near to
        uint32_t slot_count = 0;
        glm::vec3 reflectance{0};
    };
    void placeProbes(uint32_t model);
    void makeReceivers(uint32_t model);

    const RayScene& rays_;
    std::vector<Model> models_;  // as in Scene::models; those that move are left empty
    std::vector<SamplePoint> points_;
    std::vector<uint32_t> first_point_;  // per receiver, and the end
    std::vector<uint32_t> model_;
    std::vector<float> area_m2_;
    ProbePlaces places_;
    std::vector<uint32_t> model_of_probe_;
};

// ModelReceivers::places() alone.
ProbePlaces probePlaces(const RayScene& rays);

// Faces from here on are not of the charts: the normals of receivers, and no_face.
inline constexpr uint32_t first_receiver_face = 0xffffff00u;
TangentFrame receiverFrame(uint32_t face);
// Faces from here on, below those, are the level's triangles, of no chart: 2 * triangle, and 1 for its back.
inline constexpr uint32_t triangle_faces = 0x80000000u;

}  // namespace dimmer::cook
