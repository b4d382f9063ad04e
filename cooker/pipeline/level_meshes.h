// The level's meshes as a pack holds them: with lightmap UVs, split by material and page.
#pragma once

#include <charts/unwrap.h>
#include <pack/pack_data.h>

#include <span>

namespace dimmer::cook {

// The one colour that a mesh is drawn with: the material's, times the mean of its texture.
glm::vec3 meanReflectance(const Scene& scene, const Material& material);

// `emission_cd_m2`: per material, in the place of the scene's own; empty: those.
std::vector<Mesh> levelMeshes(const RayScene& rays, const Unwrap& unwrap,
                              std::span<const glm::vec3> emission_cd_m2 = {});

}  // namespace dimmer::cook
