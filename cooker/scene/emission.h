// What surfaces emit where their materials have emissive textures: of each triangle the mean.
#pragma once

#include <scene/scene.h>

#include <span>

namespace dimmer::cook {

// cd/m2 of a triangle of the mesh: its material's, times the mean of its emissive texture over the triangle.
// Deterministic; costs up to 4,096 looks at the texture.
glm::vec3 emissionOf(const Scene& scene, const SceneMesh& mesh, uint32_t triangle);

// What of its own emission a material has left on these meshes (indices into Scene::meshes), by area: 1 without a
// texture.
glm::vec3 meanEmissionShare(const Scene& scene, std::span<const uint32_t> meshes, uint32_t material);

}  // namespace dimmer::cook
