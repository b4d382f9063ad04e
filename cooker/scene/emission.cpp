#include <scene/emission.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// Of each side, in as many parts: the triangle falls into their square, all alike.
constexpr uint32_t parts_min = 8, parts_max = 64;
constexpr float parts_per_texel = 2;

// The mean over the middles of the parts, which is exact where the texture changes evenly.
glm::vec3 shareOf(const Texture& texture, const SceneMesh& mesh, uint32_t triangle) {
    if (mesh.uv0.empty()) return glm::vec3(texture.sample(glm::vec2(0)));
    const glm::uvec3 index = mesh.triangles[triangle];
    const glm::vec2 a = mesh.uv0[index.x], ab = mesh.uv0[index.y] - a, ac = mesh.uv0[index.z] - a;
    const glm::vec2 size(texture.width, texture.height);
    const float side_texels = std::max(glm::length(ab * size), glm::length(ac * size));
    const auto parts = static_cast<uint32_t>(
        std::clamp(parts_per_texel * side_texels, static_cast<float>(parts_min), static_cast<float>(parts_max)));
    glm::dvec3 sum(0);
    const auto look = [&](uint32_t i, uint32_t j, float middle) {
        const glm::vec2 at = (glm::vec2(i, j) + middle) / static_cast<float>(parts);
        sum += glm::dvec3(glm::vec3(texture.sample(a + at.x * ab + at.y * ac)));
    };
    for (uint32_t i = 0; i < parts; ++i)
        for (uint32_t j = 0; i + j < parts; ++j) {
            look(i, j, 1.0f / 3);
            if (i + j + 1 < parts) look(i, j, 2.0f / 3);
        }
    return glm::vec3(sum / static_cast<double>(parts * parts));
}

}  // namespace

glm::vec3 emissionOf(const Scene& scene, const SceneMesh& mesh, uint32_t triangle) {
    const Material& material = scene.materials[mesh.triangle_materials[triangle]];
    if (!material.emissive_texture || material.emission_cd_m2 == glm::vec3(0)) return material.emission_cd_m2;
    return material.emission_cd_m2 * shareOf(*scene.emissive_textures[*material.emissive_texture], mesh, triangle);
}

glm::vec3 meanEmissionShare(const Scene& scene, std::span<const uint32_t> meshes, uint32_t material) {
    const auto& texture = scene.materials[material].emissive_texture;
    if (!texture) return glm::vec3(1);
    glm::dvec3 sum(0);
    double area_m2 = 0;
    for (const uint32_t m : meshes) {
        const SceneMesh& mesh = scene.meshes[m];
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            if (mesh.triangle_materials[t] != material) continue;
            const glm::uvec3 index = mesh.triangles[t];
            const glm::vec3 a = mesh.positions_m[index.x];
            const double area = 0.5 * static_cast<double>(glm::length(
                                          glm::cross(mesh.positions_m[index.y] - a, mesh.positions_m[index.z] - a)));
            sum += area * glm::dvec3(shareOf(*scene.emissive_textures[*texture], mesh, t));
            area_m2 += area;
        }
    }
    return area_m2 > 0 ? glm::vec3(sum / area_m2) : glm::vec3(0);
}

}  // namespace dimmer::cook
