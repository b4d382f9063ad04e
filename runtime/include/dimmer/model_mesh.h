// Meshes that light grids light, as a pack holds them: in a model's own space, shared by its instances, in 20 bytes a
// vertex that a vertex buffer takes as they are.
#pragma once

#include <dimmer/models.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace dimmer {

struct ModelVertex {
    std::array<uint16_t, 3> position = {};  // UNORM, over the mesh's box
    std::array<int16_t, 2> normal = {};     // SNORM, octahedral: see modelNormal()
    // SNORM: what light that arrives from a direction does to this vertex, the model's own shadow included; nine
    // coefficients, each in units of transfer_bounds.
    std::array<int8_t, 9> transfer = {};
    uint8_t spare = 0;
    bool operator==(const ModelVertex&) const = default;
};
static_assert(sizeof(ModelVertex) == 20);

struct ModelMesh {
    std::string name;                             // of the first node that has it
    std::array<float, 3> min_m = {}, max_m = {};  // box of its positions, model space
    std::array<float, 3> reflectance = {};        // Lambert, linear Rec.709
    std::array<float, 3> emission_cd_m2 = {};     // radiance of an emissive material
    std::optional<uint32_t> emission_set;         // index into elements(): the set that dims the emission
    std::vector<ModelVertex> vertices;            // single-sided, as Mesh's
    std::vector<uint32_t> indices;                // 3 per triangle, counter-clockwise seen from its front
};

// A thing of the level that a light grid lights: it stands, with a grid of its own in the pack, or it moves.
struct PlacedModel {
    std::string node;
    uint32_t first_mesh = 0, mesh_count = 0;      // of Pack::modelMeshes(); none: a place for things that move
    std::optional<uint32_t> local_grid;           // of Pack::localGridSlot(); empty: it moves, see LightState::addModel
    Transform world_from_model;                   // rigid; of what moves, as the level has it
    std::array<float, 3> min_m = {}, max_m = {};  // its box, model space; zeros where it has no meshes
};

// Positions are exact to half of 1/65535 of the box's side; normals to 0.004 degrees.
std::array<float, 3> modelPosition(const ModelMesh& mesh, const ModelVertex& vertex);
std::array<float, 3> modelNormal(const ModelVertex& vertex);

// The cosine-weighted visibility of a surface in spherical harmonics, bands 0..2, as Radiance has them: irradiance is
// the sum of products with the radiance's coefficients (Sloan, Kautz and Snyder 2002, Precomputed Radiance Transfer).
struct LightTransfer {
    std::array<float, 9> coefficients = {};
};
// The largest coefficient that a band of a cosine lobe can have with any part of it hidden: sqrt(pi) / 2, sqrt(pi / 3),
// and by numerical search.
inline constexpr std::array<float, 3> transfer_bounds = {0.886226925f, 1.02332671f, 0.661f};

// Of a vertex, in the world's axes. The CPU twin of dimmer_transfer in grid.glsl.
LightTransfer modelTransfer(const ModelVertex& vertex, const Transform& world_from_model);
// By the rotation of a transform.
LightTransfer turned(const LightTransfer& transfer, const Transform& world_from_model);
// Without self-visibility: of the normal alone; unit, world axes.
LightTransfer normalTransfer(std::array<float, 3> normal);

}  // namespace dimmer
