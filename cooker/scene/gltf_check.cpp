#include <fmt/format.h>
#include <scene/gltf_check.h>

#include <algorithm>
#include <array>

namespace dimmer::cook {
namespace {

constexpr std::array<std::string_view, 6> known_extensions = {
    "EXT_lights_ies",         "KHR_lights_punctual",   "KHR_materials_emissive_strength",
    "KHR_materials_specular", "KHR_mesh_quantization", "KHR_texture_transform"};
constexpr const char* lights_extension = "KHR_lights_punctual";

// Gloss, notes, and other ways to data that a file which does not require them has in the usual way too.
constexpr std::array<std::string_view, 17> harmless_extensions = {
    "EXT_meshopt_compression",   "EXT_texture_webp",
    "KHR_animation_pointer",     "KHR_draco_mesh_compression",
    "KHR_materials_anisotropy",  "KHR_materials_clearcoat",
    "KHR_materials_dispersion",  "KHR_materials_ior",
    "KHR_materials_iridescence", "KHR_materials_sheen",
    "KHR_materials_variants",    "KHR_materials_volume",
    "KHR_texture_basisu",        "KHR_xmp",
    "KHR_xmp_json_ld",           "MSFT_lod",
    "MSFT_texture_dds"};

struct IgnoredExtension {
    std::string_view name, loss;
};
constexpr std::array<IgnoredExtension, 5> lossy_extensions = {
    {{"EXT_mesh_gpu_instancing",
      "each node that has it stands there once, by its own transform. Export its instances as nodes."},
     {"KHR_materials_pbrSpecularGlossiness",
      "a material without metallic-roughness values besides is white metal. Convert the materials to "
      "metallic-roughness."},
     {"KHR_materials_unlit", "surfaces that have it are lit and reflect as others do."},
     {"KHR_node_visibility", "what is hidden is baked as if it were seen. Export the level without hidden nodes."},
     {"KHR_materials_transmission",
      "what lets light through by it alone is opaque. Give such glass alphaMode BLEND and an alpha below 1."}}};

class Checker {
   public:
    explicit Checker(const ImportContext& context) : context_(context), model_(context.model) {}

    Expected<void> run() {
        for (const auto step : {&Checker::bufferViews, &Checker::accessors, &Checker::images, &Checker::materials,
                                &Checker::meshes, &Checker::nodes, &Checker::tree, &Checker::scenes})
            if (const Expected<void> done = (this->*step)(); !done) return done;
        return {};
    }

   private:
    template <class T>
    Expected<void> index(int value, const std::vector<T>& all, const std::string& owner, std::string_view what) const {
        if (value >= 0 && static_cast<size_t>(value) < all.size()) return {};
        return context_.error(owner, fmt::format("refers to {} {}, but the file has {}. Export the level again.", what,
                                                 value, all.size()));
    }
    template <class T>
    Expected<void> optionalIndex(int value, const std::vector<T>& all, const std::string& owner,
                                 std::string_view what) const {
        return value == -1 ? Expected<void>() : index(value, all, owner, what);
    }

    Expected<void> bufferViews() {
        for (size_t i = 0; i < model_.bufferViews.size(); ++i) {
            const tinygltf::BufferView& view = model_.bufferViews[i];
            const std::string owner = fmt::format("buffer view {}", i);
            if (const auto ok = index(view.buffer, model_.buffers, owner, "buffer"); !ok) return ok;
            // The parser takes a GLB's chunk for any buffer without one; it is the first buffer's alone
            // (glTF 2.0, 3.6.1.2).
            if (view.buffer > 0 && model_.buffers[static_cast<size_t>(view.buffer)].uri.empty())
                return context_.error(owner, fmt::format("is of buffer {}, which has no uri: its bytes are nowhere. "
                                                         "Export the level again, without mesh compression.",
                                                         view.buffer));
            const size_t size = model_.buffers[static_cast<size_t>(view.buffer)].data.size();
            if (view.byteOffset > size || view.byteLength > size - view.byteOffset)
                return context_.error(
                    owner, fmt::format("bytes {} to {} + {} are past the end of buffer {} ({} bytes). "
                                       "Export the level again.",
                                       view.byteOffset, view.byteOffset, view.byteLength, view.buffer, size));
        }
        return {};
    }

    Expected<void> accessors() {
        for (size_t i = 0; i < model_.accessors.size(); ++i) {
            const std::string owner = fmt::format("accessor {}", i);
            const int view = model_.accessors[i].bufferView;
            if (const auto ok = optionalIndex(view, model_.bufferViews, owner, "buffer view"); !ok) return ok;
        }
        return {};
    }

    Expected<void> images() {
        for (int i = 0; const tinygltf::Image& image : model_.images) {
            const std::string owner = context_.imageLabel(i++);
            const auto ok = optionalIndex(image.bufferView, model_.bufferViews, owner, "buffer view");
            if (!ok) return ok;
        }
        for (size_t i = 0; i < model_.textures.size(); ++i) {
            const tinygltf::Texture& texture = model_.textures[i];
            const std::string owner = fmt::format("texture {}", i);
            if (const auto ok = optionalIndex(texture.source, model_.images, owner, "image"); !ok) return ok;
            if (const auto ok = optionalIndex(texture.sampler, model_.samplers, owner, "sampler"); !ok) return ok;
        }
        return {};
    }

    Expected<void> materials() {
        for (int i = 0; const tinygltf::Material& material : model_.materials) {
            const std::string owner = context_.materialLabel(i++);
            for (const int texture :
                 {material.pbrMetallicRoughness.baseColorTexture.index,
                  material.pbrMetallicRoughness.metallicRoughnessTexture.index, material.emissiveTexture.index})
                if (const auto ok = optionalIndex(texture, model_.textures, owner, "texture"); !ok) return ok;
        }
        return {};
    }

    Expected<void> meshes() {
        for (int i = 0; const tinygltf::Mesh& mesh : model_.meshes) {
            const std::string owner = context_.meshLabel(i++);
            for (const tinygltf::Primitive& primitive : mesh.primitives) {
                if (const auto ok = optionalIndex(primitive.material, model_.materials, owner, "material"); !ok)
                    return ok;
                if (const auto ok = optionalIndex(primitive.indices, model_.accessors, owner, "accessor"); !ok)
                    return ok;
                for (const auto& [name, accessor] : primitive.attributes)
                    if (const auto ok = index(accessor, model_.accessors, owner, name + " accessor"); !ok) return ok;
            }
        }
        return {};
    }

    Expected<void> nodes() {
        for (int i = 0; const tinygltf::Node& node : model_.nodes) {
            const std::string owner = context_.nodeLabel(i++);
            if (const auto ok = optionalIndex(node.mesh, model_.meshes, owner, "mesh"); !ok) return ok;
            if (const auto ok = optionalIndex(node.camera, model_.cameras, owner, "camera"); !ok) return ok;
            if (const auto ok = light(node, owner); !ok) return ok;
        }
        return {};
    }

    Expected<void> light(const tinygltf::Node& node, const std::string& owner) const {
        const auto extension = node.extensions.find(lights_extension);
        if (extension == node.extensions.end()) return {};
        if (!extension->second.Has("light") || !extension->second.Get("light").IsInt())
            return context_.error(owner, "its KHR_lights_punctual names no light. Export the level again.");
        return index(extension->second.Get("light").Get<int>(), model_.lights, owner, "light");
    }

    // At most one parent each; then what no root reaches is a cycle.
    Expected<void> tree() {
        parent_.assign(model_.nodes.size(), -1);
        for (size_t i = 0; i < model_.nodes.size(); ++i)
            for (const int child : model_.nodes[i].children) {
                const std::string owner = context_.nodeLabel(static_cast<int>(i));
                if (const auto ok = index(child, model_.nodes, owner, "child node"); !ok) return ok;
                int& of_child = parent_[static_cast<size_t>(child)];
                if (of_child != -1)
                    return context_.error(context_.nodeLabel(child),
                                          fmt::format("is a child of both {} and {}. Give it one parent.",
                                                      context_.nodeLabel(of_child), owner));
                of_child = static_cast<int>(i);
            }
        return acyclic();
    }

    Expected<void> acyclic() const {
        std::vector<bool> reached(parent_.size(), false);
        std::vector<size_t> open;
        for (size_t i = 0; i < parent_.size(); ++i)
            if (parent_[i] == -1) open.push_back(i);
        while (!open.empty()) {
            const size_t node = open.back();
            open.pop_back();
            reached[node] = true;
            for (const int child : model_.nodes[node].children) open.push_back(static_cast<size_t>(child));
        }
        const auto stranded = std::ranges::find(reached, false);
        if (stranded == reached.end()) return {};
        return context_.error(context_.nodeLabel(static_cast<int>(stranded - reached.begin())),
                              "is its own ancestor, or below such a node. Break the cycle in the node tree.");
    }

    Expected<void> scenes() {
        if (model_.scenes.empty())
            return context_.error("scenes", "the file has no scene. Export the level with its scene.");
        if (const auto ok = optionalIndex(model_.defaultScene, model_.scenes, "default scene", "scene"); !ok) return ok;
        const size_t used = model_.defaultScene < 0 ? 0 : static_cast<size_t>(model_.defaultScene);
        const std::string owner = fmt::format("scene {}", used);
        std::vector<bool> root(model_.nodes.size(), false);
        for (const int node : model_.scenes[used].nodes) {
            if (const auto ok = index(node, model_.nodes, owner, "node"); !ok) return ok;
            if (root[static_cast<size_t>(node)] || parent_[static_cast<size_t>(node)] != -1)
                return context_.error(context_.nodeLabel(node),
                                      "is in the scene twice, or below another node too. List every root once.");
            root[static_cast<size_t>(node)] = true;
        }
        return {};
    }

    const ImportContext& context_;
    const tinygltf::Model& model_;
    std::vector<int> parent_;  // node of which a node is the child, or -1
};

}  // namespace

Expected<void> checkModel(const ImportContext& context) {
    return Checker(context).run();
}

bool isKnownExtension(std::string_view name) {
    return std::ranges::count(known_extensions, name) > 0;
}

void warnOfOtherScenes(ImportContext& context) {
    const auto& scenes = context.model.scenes;
    if (scenes.size() < 2) return;
    const auto used = static_cast<size_t>(std::max(context.model.defaultScene, 0));
    context.warn("scenes", fmt::format("the level is scene {}{}; the file's other {} left out. Export one scene.", used,
                                       scenes[used].name.empty() ? "" : fmt::format(" ('{}')", scenes[used].name),
                                       scenes.size() == 2 ? "one is" : fmt::format("{} are", scenes.size() - 1)));
}

void warnOfExtensions(ImportContext& context) {
    for (const std::string& name : context.model.extensionsUsed) {
        if (isKnownExtension(name) || std::ranges::count(harmless_extensions, name) > 0) continue;
        const auto lossy = std::ranges::find(lossy_extensions, name, &IgnoredExtension::name);
        context.warn(
            "extensionsUsed",
            fmt::format("'{}' is ignored: {}", name,
                        lossy != lossy_extensions.end()
                            ? lossy->loss
                            : "if it changes what is seen, the bake lacks that. Export the level without it."));
    }
}

std::optional<int> lightOf(const tinygltf::Node& node) {
    const auto extension = node.extensions.find(lights_extension);
    if (extension == node.extensions.end()) return std::nullopt;
    return extension->second.Get("light").Get<int>();
}

}  // namespace dimmer::cook
