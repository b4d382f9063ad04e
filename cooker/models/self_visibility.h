// What a model hides of the world from its own surface, and what it throws back instead.
#pragma once

#include <dimmer/model_mesh.h>
#include <scene/scene.h>

#include <array>
#include <vector>

namespace dimmer::cook {

// By mesh of the model and vertex of the mesh: of its front, and of its back where the mesh has a double-sided material
// (else the same as the front's).
using ModelTransfers = std::vector<std::vector<std::array<LightTransfer, 2>>>;

// In the model's axes. 512 rays from around each vertex against the model's own triangles: light from far away that
// arrives straight, and after up to two bounces off the model itself, by the mean of its reflectance's channels (Sloan,
// Kautz and Snyder 2002, interreflected transfer). A convex model hides nothing, and gives the transfer of the normal.
ModelTransfers selfVisibility(const Scene& scene, const SceneModel& model);

}  // namespace dimmer::cook
