#include <fmt/format.h>
#include <scene/image.h>
#include <scene/material.h>

#include <map>

namespace dimmer::cook {
namespace {

class MaterialImporter {
   public:
    MaterialImporter(ImportContext& context, std::vector<bool> used) : context_(context), used_(std::move(used)) {}

    Expected<std::vector<TextureMapping>> run() {
        const auto& materials = context_.model.materials;
        for (size_t i = 0; i < materials.size(); ++i)
            if (const auto ok = add(materials[i], static_cast<int>(i)); !ok) return std::unexpected(ok.error());
        return std::move(mappings_);
    }

   private:
    Expected<void> add(const tinygltf::Material& source, int index) {
        owner_ = context_.materialLabel(index);
        Material material;
        material.name = source.name.empty() ? fmt::format("material_{}", index) : source.name;
        material.double_sided = source.doubleSided;
        is_used_ = used_[static_cast<size_t>(index)];
        for (const auto step :
             {&MaterialImporter::surface, &MaterialImporter::baseTexture, &MaterialImporter::metalTexture,
              &MaterialImporter::specular, &MaterialImporter::emission, &MaterialImporter::alphaMode})
            if (const auto ok = (this->*step)(source, material); !ok) return ok;
        context_.scene.materials.push_back(std::move(material));
        return {};
    }

    // A factor that glTF limits to 0..1: beyond is clamped and said so, not a number is an error.
    Expected<float> factor(double value, std::string_view name) {
        if (!isFiniteFloat(value)) return notFinite(name);
        if (value < 0 || value > 1)
            context_.warn(owner_, fmt::format("'{}' is {}, outside 0..1, and was clamped.", name, value));
        return static_cast<float>(glm::clamp(value, 0.0, 1.0));
    }
    std::unexpected<Error> notFinite(std::string_view name) const {
        return context_.error(owner_, fmt::format("'{}' is not a finite number. Correct the material.", name));
    }

    Expected<void> surface(const tinygltf::Material& source, Material& material) {
        const auto& pbr = source.pbrMetallicRoughness;
        float base[4];
        for (size_t c = 0; c < 4; ++c) {
            const auto value = factor(pbr.baseColorFactor[c], "baseColorFactor");
            if (!value) return std::unexpected(value.error());
            base[c] = *value;
        }
        material.base_color = {base[0], base[1], base[2]};
        material.alpha = base[3];
        const auto metallic = factor(pbr.metallicFactor, "metallicFactor");
        if (!metallic) return std::unexpected(metallic.error());
        material.metallic = *metallic;
        return {};
    }

    // The image behind a texture of a material that is used; images of others may be missing, and take no memory.
    // Empty, with a warning, when there is none that the bake can read: a texture may exist for an extension's image
    // alone.
    std::optional<int> imageOf(const tinygltf::TextureInfo& info, std::string_view what) {
        if (info.index < 0 || !is_used_) return std::nullopt;
        const int source = context_.model.textures[static_cast<size_t>(info.index)].source;
        if (source >= 0) return source;
        context_.warn(owner_, fmt::format("its {} texture has no PNG or JPEG image and was ignored.", what));
        return std::nullopt;
    }

    // Each image is decoded once; its index in `textures`.
    using Images = std::map<int, size_t>;
    Expected<uint32_t> textureOf(int image, std::vector<std::shared_ptr<const Texture>>& textures, Images& known) {
        const auto [it, is_new] = known.try_emplace(image, textures.size());
        if (is_new) {
            Expected<Texture> decoded = decodeImage(context_, image, TransferFunction::Srgb, owner_);
            if (!decoded) return std::unexpected(decoded.error());
            textures.push_back(std::make_shared<const Texture>(std::move(*decoded)));
        }
        return static_cast<uint32_t>(it->second);
    }

    Expected<void> baseTexture(const tinygltf::Material& source, Material& material) {
        constexpr std::string_view what = "base colour";
        const tinygltf::TextureInfo& info = source.pbrMetallicRoughness.baseColorTexture;
        mappings_.emplace_back();
        const auto image = imageOf(info, what);
        if (!image) return {};
        const auto texture = textureOf(*image, context_.scene.textures, base_images_);
        if (!texture) return std::unexpected(texture.error());
        material.base_color_texture = *texture;
        warnWrapping(info, what);
        const auto mapped = mapping(info);
        if (!mapped) return std::unexpected(mapped.error());
        mappings_.back() = *mapped;
        return {};
    }

    void warnWrapping(const tinygltf::TextureInfo& info, std::string_view what) {
        const int sampler = context_.model.textures[static_cast<size_t>(info.index)].sampler;
        if (sampler < 0) return;
        const tinygltf::Sampler& s = context_.model.samplers[static_cast<size_t>(sampler)];
        if (s.wrapS != TINYGLTF_TEXTURE_WRAP_REPEAT || s.wrapT != TINYGLTF_TEXTURE_WRAP_REPEAT)
            context_.warn(owner_,
                          fmt::format("its {} texture is clamped or mirrored; the bake repeats it instead.", what));
    }

    // KHR_texture_transform: uv' = translation * rotation * scale * uv, rotated counter-clockwise as seen on the image
    // (v points down). That is its text and what Khronos' sample viewer does; the shader in its README turns the other
    // way.
    Expected<TextureMapping> mapping(const tinygltf::TextureInfo& info) const {
        TextureMapping mapping;
        mapping.tex_coord = info.texCoord;
        const auto extension = info.extensions.find("KHR_texture_transform");
        if (extension != info.extensions.end() && extension->second.IsObject()) {
            const tinygltf::Value& values = extension->second;
            const glm::dvec2 offset = pair(values, "offset", glm::dvec2(0)),
                             scale = pair(values, "scale", glm::dvec2(1));
            const double angle = values.Has("rotation") ? values.Get("rotation").GetNumberAsDouble() : 0;
            const double c = std::cos(angle), s = std::sin(angle);
            mapping.u_axis = glm::dvec3(c * scale.x, s * scale.y, offset.x);
            mapping.v_axis = glm::dvec3(-s * scale.x, c * scale.y, offset.y);
            if (values.Has("texCoord")) mapping.tex_coord = values.Get("texCoord").Get<int>();
        }
        if (!isFinite(mapping.u_axis) || !isFinite(mapping.v_axis)) return notFinite("KHR_texture_transform");
        return mapping;
    }

    // Two numbers, as checkTypes() saw to.
    static glm::dvec2 pair(const tinygltf::Value& values, const std::string& key, glm::dvec2 otherwise) {
        if (!values.Has(key)) return otherwise;
        const tinygltf::Value& list = values.Get(key);
        return {list.Get(0).GetNumberAsDouble(), list.Get(1).GetNumberAsDouble()};
    }

    Expected<glm::vec4> mean(int image, TransferFunction transfer, std::string_view what) {
        const auto decoded = decodeImage(context_, image, transfer, owner_);
        if (!decoded) return std::unexpected(decoded.error());
        context_.warn(owner_, fmt::format("the bake uses the mean of its {} texture.", what));
        return decoded->mean();
    }

    Expected<void> metalTexture(const tinygltf::Material& source, Material& material) {
        const auto image = material.metallic == 0
                               ? std::nullopt
                               : imageOf(source.pbrMetallicRoughness.metallicRoughnessTexture, "metalness");
        if (!image) return {};
        const auto texel = mean(*image, TransferFunction::Linear, "metalness");
        if (!texel) return std::unexpected(texel.error());
        material.metallic *= texel->b;  // the blue channel holds the metalness
        return {};
    }

    // A number of a material extension; `otherwise` when the material has no such extension or member.
    double extensionNumber(const tinygltf::Material& source, const char* extension, const char* key,
                           double otherwise) const {
        const auto found = source.extensions.find(extension);
        if (found == source.extensions.end() || !found->second.Has(key)) return otherwise;
        const tinygltf::Value& value = found->second.Get(key);
        return value.IsNumber() ? value.GetNumberAsDouble() : std::nan("");
    }

    Expected<void> specular(const tinygltf::Material& source, Material& material) {
        const auto value =
            factor(extensionNumber(source, "KHR_materials_specular", "specularFactor", 1), "specularFactor");
        if (!value) return std::unexpected(value.error());
        material.specular = *value;
        return {};
    }

    Expected<void> emission(const tinygltf::Material& source, Material& material) {
        const double strength = extensionNumber(source, "KHR_materials_emissive_strength", "emissiveStrength", 1);
        const auto& f = source.emissiveFactor;
        const glm::dvec3 emission = glm::dvec3(f[0], f[1], f[2]) * strength;
        if (!isFinite(emission)) return notFinite("emissiveFactor x emissiveStrength");
        if (glm::any(glm::lessThan(emission, glm::dvec3(0))))
            return context_.error(owner_, "its emission is negative. Give it 0 or more.");
        material.emission_cd_m2 = emission;
        return isEmissive(material) ? emissiveTexture(source.emissiveTexture, material) : Expected<void>{};
    }

    // Coordinates are kept of one texture of each material.
    Expected<void> emissiveTexture(const tinygltf::TextureInfo& info, Material& material) {
        constexpr std::string_view what = "emissive";
        const auto image = imageOf(info, what);
        if (!image) return {};
        const auto mapped = mapping(info);
        if (!mapped) return std::unexpected(mapped.error());
        if (material.base_color_texture && *mapped != mappings_.back()) {
            const auto texel = mean(*image, TransferFunction::Srgb, what);
            if (!texel) return std::unexpected(texel.error());
            material.emission_cd_m2 *= glm::vec3(*texel);
            return {};
        }
        mappings_.back() = *mapped;
        warnWrapping(info, what);
        const auto texture = textureOf(*image, context_.scene.emissive_textures, emissive_images_);
        if (!texture) return std::unexpected(texture.error());
        material.emissive_texture = *texture;
        // Where no texel shines, nothing does.
        if (context_.scene.emissive_textures[*texture]->mean() * glm::vec4(1, 1, 1, 0) == glm::vec4(0))
            material.emission_cd_m2 = glm::vec3(0);
        return {};
    }

    Expected<void> alphaMode(const tinygltf::Material& source, Material& material) {
        if (source.alphaMode == "MASK")
            material.alpha_mode = AlphaMode::Mask;
        else if (source.alphaMode == "BLEND")
            material.alpha_mode = AlphaMode::Blend;
        else if (source.alphaMode != "OPAQUE")
            return context_.error(owner_,
                                  fmt::format("'alphaMode' is '{}'. Use OPAQUE, MASK or BLEND.", source.alphaMode));
        if (!isFiniteFloat(source.alphaCutoff)) return notFinite("alphaCutoff");
        material.alpha_cutoff = static_cast<float>(source.alphaCutoff);
        // Exporters say of many a wall that it may have holes.
        const float whole = material.alpha_mode == AlphaMode::Mask ? material.alpha_cutoff : 1;
        if (!material.base_color_texture && material.alpha >= whole) material.alpha_mode = AlphaMode::Opaque;
        return {};
    }

    ImportContext& context_;
    std::string owner_;     // the material at hand
    bool is_used_ = false;  // likewise
    std::vector<TextureMapping> mappings_;
    std::vector<bool> used_;  // per material
    Images base_images_, emissive_images_;
};

}  // namespace

// design: c (1 - rs) + rs; rs is the share that a rough GGX surface reflects specularly, its Fresnel term
// F0 + (1 - F0)/21 averaged over the hemisphere (Schlick), mixed towards the base colour for metals.
glm::vec3 Material::reflectance(glm::vec3 color) const {
    constexpr float dielectric = 0.04f + 0.96f / 21.0f;
    const glm::vec3 diffuse = color * (1 - metallic);
    const glm::vec3 rs = glm::mix(glm::vec3(specular * dielectric), color, metallic);
    return glm::clamp(diffuse * (1.0f - rs) + rs, 0.0f, 0.99f);
}

Material defaultMaterial() {
    Material material;
    material.name = "default";
    material.metallic = 1;
    return material;
}

Expected<std::vector<TextureMapping>> importMaterials(ImportContext& context, std::vector<bool> used) {
    return MaterialImporter(context, std::move(used)).run();
}

}  // namespace dimmer::cook
