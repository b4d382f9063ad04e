#include <write/gltf_prune.h>

#include <algorithm>
#include <functional>
#include <string_view>

namespace dimmer::cook {
namespace {

using Json = GlbDocument::Json;
using Visit = std::function<void(Json& index)>;

void visitMember(Json& object, const char* key, const Visit& visit) {
    if (const auto found = object.find(key); found != object.end()) visit(*found);
}

// Calls `each` for the items of an array member, if there is one.
template <class Each>
void forItems(Json& object, const char* key, Each&& each) {
    if (const auto found = object.find(key); found != object.end())
        for (Json& item : *found) each(item);
}

void forMeshReferences(Json& d, const Visit& visit) {
    forItems(d, "nodes", [&](Json& node) { visitMember(node, "mesh", visit); });
}

void forAccessorReferences(Json& d, const Visit& visit) {
    forItems(d, "meshes", [&](Json& mesh) {
        forItems(mesh, "primitives", [&](Json& primitive) {
            forItems(primitive, "attributes", visit);
            visitMember(primitive, "indices", visit);
            forItems(primitive, "targets", [&](Json& target) {
                for (Json& index : target) visit(index);
            });
        });
    });
    forItems(d, "animations", [&](Json& animation) {
        forItems(animation, "samplers", [&](Json& sampler) {
            visitMember(sampler, "input", visit);
            visitMember(sampler, "output", visit);
        });
    });
    forItems(d, "skins", [&](Json& skin) { visitMember(skin, "inverseBindMatrices", visit); });
}

void forViewReferences(Json& d, const Visit& visit) {
    forItems(d, "accessors", [&](Json& accessor) {
        visitMember(accessor, "bufferView", visit);
        visitMember(accessor, "sparse", [&](Json& sparse) {
            visitMember(sparse["indices"], "bufferView", visit);
            visitMember(sparse["values"], "bufferView", visit);
        });
    });
    forItems(d, "images", [&](Json& image) { visitMember(image, "bufferView", visit); });
    visitMember(d, "extensions", [&](Json& extensions) {
        visitMember(extensions, "EXT_lights_ies", [&](Json& ies) {
            forItems(ies, "lights", [&](Json& light) { visitMember(light, "bufferView", visit); });
        });
    });
}

// Those that have no references but the ones above.
bool onlyKnownReferences(const Json& d) {
    const auto known = [](const std::string& name) {
        for (const std::string_view prefix : {"KHR_materials_", "KHR_texture_", "EXT_texture_"})
            if (name.starts_with(prefix) && name != "KHR_materials_variants") return true;
        return name == "KHR_lights_punctual" || name == "EXT_lights_ies" || name == "KHR_mesh_quantization";
    };
    const auto used = d.find("extensionsUsed");
    return used == d.end() ||
           std::ranges::all_of(*used, [&](const Json& name) { return known(name.get<std::string>()); });
}

// Drops the items of an array that nothing refers to, and renumbers the references.
template <class ForReferences>
void prune(Json& d, const char* array, ForReferences&& for_references) {
    const auto found = d.find(array);
    if (found == d.end()) return;
    std::vector<size_t> new_index(found->size(), SIZE_MAX);
    for_references(d, [&](Json& index) { new_index.at(index.get<size_t>()) = 0; });
    Json kept = Json::array();
    for (size_t i = 0; i < new_index.size(); ++i) {
        if (new_index[i] == SIZE_MAX) continue;
        new_index[i] = kept.size();
        kept.push_back(std::move((*found)[i]));
    }
    *found = std::move(kept);
    for_references(d, [&](Json& index) { index = new_index.at(index.get<size_t>()); });
}

std::span<const std::byte> bytesOf(const tinygltf::Model& model, const Json& view) {
    const auto& buffer = model.buffers.at(view.at("buffer").get<size_t>()).data;
    return std::as_bytes(std::span(buffer))
        .subspan(view.value("byteOffset", size_t{0}), view.at("byteLength").get<size_t>());
}

// What an image's first bytes say that it is; else what the document says, if it does.
std::string mediaType(std::string_view encoded, const Json& image) {
    struct Format {
        std::string_view media_type, begins;
    };
    static constexpr Format formats[] = {
        {"image/png", "\x89PNG"},     {"image/jpeg", "\xFF\xD8\xFF"}, {"image/ktx2", "\xABKTX 20\xBB"},
        {"image/vnd-ms.dds", "DDS "}, {"image/gif", "GIF8"},          {"image/bmp", "BM"}};
    if (encoded.starts_with("RIFF") && encoded.substr(0, 12).ends_with("WEBP")) return "image/webp";
    for (const Format& format : formats)
        if (encoded.starts_with(format.begins)) return std::string(format.media_type);
    return image.value("mimeType", "");
}

// Into the buffer, but what nobody can tell the type of: that stays where it is.
void moveImagesIn(GlbDocument& document, const tinygltf::Model& model) {
    size_t i = 0;
    forItems(document.json, "images", [&](Json& image) {
        const auto& encoded = model.images.at(i++).image;
        if (image.contains("bufferView") || encoded.empty()) return;
        const std::string type = mediaType({reinterpret_cast<const char*>(encoded.data()), encoded.size()}, image);
        if (type.empty()) return;
        const size_t view = document.addView(std::as_bytes(std::span(encoded)));
        image.erase("uri");
        image["bufferView"] = view;
        image["mimeType"] = type;
    });
}

void eraseExtension(Json& object, const char* name) {
    const auto extensions = object.find("extensions");
    if (extensions == object.end()) return;
    extensions->erase(name);
    if (extensions->empty()) object.erase("extensions");
}

// Another way to data that the document has in the usual way too, and is written in that one.
void dropCompression(Json& d) {
    constexpr const char* name = "EXT_meshopt_compression";
    for (const char* list : {"bufferViews", "buffers"})
        forItems(d, list, [&](Json& item) { eraseExtension(item, name); });
    for (const char* list : {"extensionsUsed", "extensionsRequired"})
        if (const auto found = d.find(list); found != d.end())
            found->erase(std::remove(found->begin(), found->end(), Json(name)), found->end());
}

}  // namespace

void adoptUsed(GlbDocument& document, Json original, const tinygltf::Model& model) {
    document.json = std::move(original);
    Json& d = document.json;
    dropCompression(d);
    if (onlyKnownReferences(d)) {
        prune(d, "meshes", forMeshReferences);
        prune(d, "accessors", forAccessorReferences);
        prune(d, "bufferViews", forViewReferences);
    }
    Json views = d.contains("bufferViews") ? std::move(d["bufferViews"]) : Json::array();
    d["bufferViews"] = Json::array();
    for (Json& view : views) {
        const size_t index = document.addView(bytesOf(model, view));
        view["buffer"] = 0;
        view["byteOffset"] = d["bufferViews"][index]["byteOffset"];
        d["bufferViews"][index] = std::move(view);
    }
    moveImagesIn(document, model);
}

}  // namespace dimmer::cook
