// What a model hides of the world from its own surface, and what it throws back instead.
#pragma once

#include <bake/progress.h>
#include <scene/scene.h>

namespace dimmer::cook {

// 512 rays from around each vertex against the model's own triangles: light from far away that
// arrives straight, and after up to two bounces off the model itself, by the mean of its reflectance's channels (Sloan,
// Kautz and Snyder 2002, interreflected transfer). A convex model hides nothing, and gives the transfer of the normal.
ModelTransfers selfVisibility(const Scene& scene, const SceneModel& model, Progress& progress);

// Fills in those of Scene::models; models of one shape share theirs. After what changes their meshes. A stage of
// `progress` where there are such models.
void findTransfers(Scene& scene, Progress& progress);

}  // namespace dimmer::cook
