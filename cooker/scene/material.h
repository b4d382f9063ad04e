// glTF materials to the bake's: Lambert reflectance, emission, transparency.
#pragma once

#include <scene/import_context.h>

namespace dimmer::cook {

// How a material's textures are mapped (KHR_texture_transform applied to the coordinates at import): its base colour's,
// and where it has none its emissive one.
struct TextureMapping {
    int tex_coord = 0;  // which TEXCOORD_n
    // uv' = (u_axis . (u, v, 1), v_axis . (u, v, 1))
    glm::vec3 u_axis{1, 0, 0}, v_axis{0, 1, 0};

    bool operator==(const TextureMapping&) const = default;
    glm::vec2 apply(glm::vec2 uv) const {
        return {glm::dot(u_axis, glm::vec3(uv, 1)), glm::dot(v_axis, glm::vec3(uv, 1))};
    }
};

// Fills Scene::materials, one per material of the file in its order, and Scene::textures and Scene::emissive_textures
// with the images of those that are `used`, by index. Returns the materials' texture mappings.
Expected<std::vector<TextureMapping>> importMaterials(ImportContext& context, std::vector<bool> used);

// glTF's default material: white, fully metallic, single-sided.
Material defaultMaterial();

inline bool isEmissive(const Material& material) {
    return material.emission_cd_m2 != glm::vec3(0);
}

}  // namespace dimmer::cook
