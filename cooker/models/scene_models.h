// Which meshes a light grid lights, and where those grids stand.
#pragma once

#include <pack/grid_data.h>
#include <scene/scene.h>

#include <array>
#include <optional>
#include <vector>

namespace dimmer::cook {

// Decides for meshes that leave it to us (Lighting::Automatic): a lightmap, but for those that fall into many charts of
// which the mean is smaller than a hand's breadth squared, and hang together. By geometry alone, so that no setting
// changes the choice.
// Leaves of doors, what shines and what brings UVs of its own keep lightmaps, and so do all where nothing else would
// have one.
void chooseLighting(Scene& scene);

struct ModelSettings {
    float spacing_m = 1.5f;    // of probes at most, where the node does not say
    uint32_t probes_max = 64;  // of one model; the spacing grows until they are no more
};

// Fills Scene::models: what stands and has a grid, what moves, and the empty places for things that move.
void listModels(Scene& scene, const ModelSettings& settings);

// What makes nodes' models alike but for where they stand: the file's mesh, its size and what it is made of.
struct ModelShape {
    int gltf_mesh = -1;
    std::array<std::pair<int, long>, 3> scale{};  // exponent, and mantissa in tenths of a permille
    std::vector<std::vector<uint32_t>> materials;
    std::vector<size_t> vertices;  // of what import has left of each mesh
    auto operator<=>(const ModelShape&) const = default;
};
// None where a model is like no other.
std::optional<ModelShape> shapeOf(const Scene& scene, const SceneModel& model);

// Per model that stands, in the order of Scene::models; numbers of probes begin at `first_probe`.
std::vector<LocalGrid> localGrids(const Scene& scene, uint32_t first_probe);

// Where probe (i, j, k) of a model stands, number i + n_x (j + n_y k).
glm::vec3 probePosition(const SceneModel& model, uint32_t number);

}  // namespace dimmer::cook
