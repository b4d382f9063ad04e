// What light grids light, as a pack holds it.
#pragma once

#include <pack/pack_data.h>
#include <scene/scene.h>

#include <span>

namespace dimmer::cook {

// Fills pack.models in the order of Scene::models, which have their transfers, and their meshes: a mesh per material,
// quantised, in an order that vertex caches and fetches like. Models of one glTF mesh and one size share theirs.
// `emission_cd_m2` as in levelMeshes().
void describeModels(const Scene& scene, std::span<const glm::vec3> emission_cd_m2, PackData& pack);

// Vertices that are alike become one; triangles and vertices are put in their final order.
void optimise(ModelMesh& mesh);
ModelVertex quantised(const ModelMesh& box, glm::vec3 position_m, glm::vec3 normal, const LightTransfer& transfer);

}  // namespace dimmer::cook
