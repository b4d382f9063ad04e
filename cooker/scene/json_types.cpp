#include <scene/json_types.h>

#include <fmt/format.h>
#include <scene/gltf_check.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>

namespace dimmer::cook {
namespace {

using nlohmann::json;

// Whole: as many as memory can have; Small: what the parser keeps in 31 bits.
enum class Kind { Index, Indices, Whole, Small, Number, Numbers, Text, Flag, Object, IndexOfEach };

struct Rule {
    const char* key;
    Kind kind;
    size_t count = 0;  // of Numbers
};

constexpr Rule of_scene[] = {{"nodes", Kind::Indices}};
constexpr Rule of_node[] = {{"mesh", Kind::Index},
                            {"camera", Kind::Index},
                            {"children", Kind::Indices},
                            {"matrix", Kind::Numbers, 16},
                            {"rotation", Kind::Numbers, 4},
                            {"scale", Kind::Numbers, 3},
                            {"translation", Kind::Numbers, 3}};
constexpr Rule of_primitive[] = {
    {"attributes", Kind::IndexOfEach}, {"indices", Kind::Index}, {"material", Kind::Index}, {"mode", Kind::Small}};
constexpr Rule of_accessor[] = {
    {"bufferView", Kind::Index}, {"byteOffset", Kind::Whole},    {"count", Kind::Whole},  {"type", Kind::Text},
    {"normalized", Kind::Flag},  {"componentType", Kind::Small}, {"sparse", Kind::Object}};
constexpr Rule of_sparse[] = {{"count", Kind::Small}, {"indices", Kind::Object}, {"values", Kind::Object}};
constexpr Rule of_sparse_part[] = {
    {"bufferView", Kind::Index}, {"byteOffset", Kind::Small}, {"componentType", Kind::Small}};
constexpr Rule of_view[] = {
    {"buffer", Kind::Index}, {"byteOffset", Kind::Whole}, {"byteLength", Kind::Whole}, {"byteStride", Kind::Whole}};
constexpr Rule of_material[] = {{"pbrMetallicRoughness", Kind::Object}, {"emissiveFactor", Kind::Numbers, 3},
                                {"emissiveTexture", Kind::Object},      {"alphaMode", Kind::Text},
                                {"alphaCutoff", Kind::Number},          {"doubleSided", Kind::Flag}};
constexpr Rule of_material_extensions[] = {{"KHR_materials_emissive_strength", Kind::Object},
                                           {"KHR_materials_specular", Kind::Object}};
constexpr Rule of_emissive_strength[] = {{"emissiveStrength", Kind::Number}};
constexpr Rule of_specular[] = {{"specularFactor", Kind::Number}};
constexpr Rule of_light[] = {{"color", Kind::Numbers, 3},
                             {"intensity", Kind::Number},
                             {"range", Kind::Number},
                             {"spot", Kind::Object},
                             {"type", Kind::Text}};
constexpr Rule of_spot[] = {{"innerConeAngle", Kind::Number}, {"outerConeAngle", Kind::Number}};
constexpr Rule of_surface[] = {{"baseColorFactor", Kind::Numbers, 4},
                               {"baseColorTexture", Kind::Object},
                               {"metallicFactor", Kind::Number},
                               {"roughnessFactor", Kind::Number}};
constexpr Rule of_texture_info[] = {{"index", Kind::Index}, {"texCoord", Kind::Small}, {"extensions", Kind::Object}};
constexpr Rule of_texture_extensions[] = {{"KHR_texture_transform", Kind::Object}};
constexpr Rule of_texture_transform[] = {
    {"offset", Kind::Numbers, 2}, {"scale", Kind::Numbers, 2}, {"rotation", Kind::Number}, {"texCoord", Kind::Small}};
constexpr Rule of_texture[] = {{"source", Kind::Index}, {"sampler", Kind::Index}};
constexpr Rule of_image[] = {{"bufferView", Kind::Index}, {"uri", Kind::Text}, {"mimeType", Kind::Text}};

// Whose values the parser hands over as ints.
constexpr std::string_view read_extensions[] = {"EXT_lights_ies", "KHR_lights_punctual",
                                                "KHR_materials_emissive_strength", "KHR_materials_specular",
                                                "KHR_texture_transform"};

bool fitsInt(const json& v) {
    if (v.is_number_unsigned()) return v.get<uint64_t>() <= uint64_t{std::numeric_limits<int32_t>::max()};
    return v.is_number_integer() && v.get<int64_t>() >= std::numeric_limits<int32_t>::min();
}

// -1 is what the parser has for none; other negative ones are told with what they refer to (gltf_check.h).
bool isIndex(const json& v) {
    return fitsInt(v) && v.get<int64_t>() != -1;
}

bool isWhole(const json& v) {
    return v.is_number_unsigned() || (v.is_number_integer() && v.get<int64_t>() >= 0);
}

bool all(const json& v, auto&& is) {
    return std::all_of(v.begin(), v.end(), is);
}

// What the value must be; nothing where it is that.
std::string missing(const json& v, const Rule& rule) {
    const auto unless = [](bool obeys, std::string text) { return obeys ? std::string() : text; };
    switch (rule.kind) {
        case Kind::Index:
            return unless(isIndex(v), "an index from 0 to 2147483647");
        case Kind::Indices:
            return unless(v.is_array() && all(v, isIndex), "a list of indices from 0 to 2147483647");
        case Kind::IndexOfEach:
            return unless(v.is_object() && all(v, isIndex), "an object of indices from 0 to 2147483647");
        case Kind::Whole:
            return unless(isWhole(v), "a whole number from 0");
        case Kind::Small:
            return unless(fitsInt(v) && isWhole(v), "a whole number from 0 to 2147483647");
        case Kind::Number:
            return unless(v.is_number(), "a number");
        case Kind::Numbers: {
            const bool numbers = v.is_array() && all(v, [](const json& n) { return n.is_number(); });
            return unless(numbers && v.size() == rule.count, fmt::format("{} numbers", rule.count));
        }
        case Kind::Text:
            return unless(v.is_string(), "a text");
        case Kind::Flag:
            return unless(v.is_boolean(), "true or false");
        case Kind::Object:
            return unless(v.is_object(), "an object");
    }
    return {};
}

class TypeChecker {
   public:
    TypeChecker(const json& root, const std::string& file) : root_(root), file_(file) {}

    Expected<void> run() {
        static constexpr Rule of_root[] = {{"scene", Kind::Index}};
        object(root_, "the file", of_root);
        requiredExtensions();
        if (const auto ies = memberOf(memberOf(&root_, "extensions"), "EXT_lights_ies"))
            ints(*ies, "EXT_lights_ies", "the file");
        if (const auto punctual = memberOf(memberOf(&root_, "extensions"), "KHR_lights_punctual"))
            forEach(*punctual, "lights", "light", of_light,
                    [&](const json& light, const std::string& owner) { spot(light, owner); });
        forEach("scenes", "scene", of_scene);
        forEach("nodes", "node", of_node);
        forEach("accessors", "accessor", of_accessor, [&](const json& accessor, const std::string& owner) {
            inner(accessor, "sparse", owner, of_sparse);
            for (const char* part : {"indices", "values"})
                if (const json* sparse = memberOf(&accessor, "sparse")) inner(*sparse, part, owner, of_sparse_part);
        });
        forEach("bufferViews", "buffer view", of_view);
        forEach("textures", "texture", of_texture);
        forEach("images", "image", of_image, [&](const json& image, const std::string& owner) { view(image, owner); });
        forEach("meshes", "mesh", {}, [&](const json& mesh, const std::string& owner) {
            if (const auto primitives = mesh.find("primitives"); primitives != mesh.end() && primitives->is_array())
                for (const json& p : *primitives) object(p, owner, of_primitive);
        });
        forEach("materials", "material", of_material, [&](const json& material, const std::string& owner) {
            inner(material, "emissiveTexture", owner, of_texture_info);
            if (const json* extensions = memberOf(&material, "extensions")) {
                object(*extensions, owner, of_material_extensions);
                inner(*extensions, "KHR_materials_emissive_strength", owner, of_emissive_strength);
                inner(*extensions, "KHR_materials_specular", owner, of_specular);
            }
            const auto surface = material.find("pbrMetallicRoughness");
            if (surface == material.end()) return;
            object(*surface, owner, of_surface);
            inner(*surface, "baseColorTexture", owner, of_texture_info);
            // The only one whose transform counts.
            const json* extensions = memberOf(memberOf(&*surface, "baseColorTexture"), "extensions");
            if (!extensions) return;
            object(*extensions, owner, of_texture_extensions);
            inner(*extensions, "KHR_texture_transform", owner, of_texture_transform);
            intsBeside((*surface)["baseColorTexture"], owner);
        });
        if (problem_.empty()) return {};
        return fail(ErrorCode::BadInput, problem_);
    }

   private:
    // Null where there is none.
    static const json* memberOf(const json* object, const char* key) {
        if (!object || !object->is_object()) return nullptr;
        const auto found = object->find(key);
        return found == object->end() ? nullptr : &*found;
    }
    void forEach(const json& parent, const char* list, const char* what, std::span<const Rule> rules, auto&& more) {
        const auto found = parent.find(list);
        if (!parent.is_object() || found == parent.end() || !found->is_array()) return;
        for (size_t i = 0; i < found->size() && problem_.empty(); ++i) {
            const json& item = (*found)[i];
            const auto name = item.is_object() ? item.find("name") : item.end();
            const bool named = item.is_object() && name != item.end() && name->is_string() && *name != "";
            // As ImportContext labels them.
            const std::string owner =
                named ? fmt::format("{} '{}'", what, name->get<std::string>()) : fmt::format("{} {}", what, i);
            object(item, owner, rules);
            intsBeside(item, owner);
            if (item.is_object()) more(item, owner);
        }
    }
    void forEach(const json& parent, const char* list, const char* what, std::span<const Rule> rules) {
        forEach(parent, list, what, rules, [](const json&, const std::string&) {});
    }
    void forEach(const char* list, const char* what, std::span<const Rule> rules, auto&&... more) {
        forEach(root_, list, what, rules, more...);
    }
    // The parser would miss what the extension has instead: accessors without a buffer view, of compressed meshes.
    void requiredExtensions() {
        const json* names = memberOf(&root_, "extensionsRequired");
        if (!names || !names->is_array()) return;
        for (const json& name : *names) {
            if (!name.is_string() || isKnownExtension(name.get<std::string>()) || !problem_.empty()) continue;
            const auto extension = name.get<std::string>().substr(0, 60);
            const bool compressed = extension.ends_with("_compression");
            problem_ = fmt::format(
                "{}: extensionsRequired: needs the extension '{}', which is not supported. Export the level without "
                "it{}.",
                file_, extension, compressed ? " (in most exporters an option named compression)" : "");
        }
    }
    void spot(const json& light, const std::string& owner) {
        inner(light, "spot", owner, of_spot);
        const json *type = memberOf(&light, "type"), *spot = memberOf(&light, "spot");
        if (type && *type == "spot" && !spot && problem_.empty())
            problem_ = fmt::format(
                "{}: {}: is of type spot and has no 'spot' with its cone. Give it one, or make it a point light.",
                file_, owner);
    }
    // Null where there is none.
    const json* itemOf(const char* list, const json* index) const {
        const json* items = memberOf(&root_, list);
        if (!items || !items->is_array() || !index || !isWhole(*index)) return nullptr;
        const auto i = index->get<uint64_t>();
        return i < items->size() ? &(*items)[i] : nullptr;
    }
    // The parser points at the first byte of an image's view before anybody can look whether the buffer has it.
    void view(const json& image, const std::string& owner) {
        const json* view = itemOf("bufferViews", memberOf(&image, "bufferView"));
        const json* buffer = itemOf("buffers", memberOf(view, "buffer"));
        if (!buffer || !problem_.empty()) return;
        const auto whole = [](const json* v) { return v && isWhole(*v) ? v->get<uint64_t>() : 0; };
        const uint64_t begin = whole(memberOf(view, "byteOffset")), size = whole(memberOf(buffer, "byteLength"));
        if (begin >= size)
            problem_ = fmt::format(
                "{}: {}: its buffer view begins at byte {}, past the end of its buffer ({} bytes). "
                "Export the level again.",
                file_, owner, begin, size);
    }
    // Of extras and extensions what the cooker reads: the parser cuts whole numbers to 32 bits.
    void intsBeside(const json& item, const std::string& owner) {
        if (const json* extras = memberOf(&item, "extras"); extras && extras->is_object())
            for (const auto& [key, value] : extras->items())
                if (key.starts_with("dimmer_")) {
                    stated(value, key, owner);
                    ints(value, key, owner);
                }
        if (const json* extensions = memberOf(&item, "extensions"); extensions && extensions->is_object())
            for (const auto& [key, value] : extensions->items())
                if (std::ranges::count(read_extensions, key) > 0) ints(value, key, owner);
    }
    // The parser takes null, and objects and lists without members, for what is not there: a lamp would no longer be of
    // its set. No combinations are none either way.
    void stated(const json& value, const std::string& key, const std::string& owner) {
        const bool is_list = value.is_array() && key == "dimmer_combinations";
        if (value.empty() && !is_list && problem_.empty())
            problem_ =
                fmt::format("{}: {}: '{}' is {}. Give it a value, or leave it out.", file_, owner, key, value.dump());
    }
    void ints(const json& value, const std::string& key, const std::string& owner) {
        if (value.is_object())
            for (const auto& [inner_key, inner_value] : value.items()) ints(inner_value, inner_key, owner);
        else if (value.is_array())
            for (const json& item : value) ints(item, key, owner);
        else if (value.is_number_integer() && !fitsInt(value) && problem_.empty())
            problem_ = fmt::format(
                "{}: {}: '{}' is {}, more than a whole number here can be. Write it with an exponent, "
                "as 3e9.",
                file_, owner, key, value.dump());
    }
    void inner(const json& parent, const char* key, const std::string& owner, std::span<const Rule> rules) {
        if (!parent.is_object()) return;
        if (const auto found = parent.find(key); found != parent.end()) object(*found, owner, rules);
    }
    // The first problem stays.
    void object(const json& item, const std::string& owner, std::span<const Rule> rules) {
        if (!item.is_object()) return;
        for (const Rule& rule : rules) {
            const auto value = item.find(rule.key);
            if (value == item.end() || !problem_.empty()) continue;
            const std::string expected = missing(*value, rule);
            if (expected.empty()) continue;
            constexpr size_t length_max = 60;
            std::string text = value->dump(-1, ' ', true, json::error_handler_t::replace);
            if (text.size() > length_max) text = text.substr(0, length_max) + "...";
            problem_ = fmt::format("{}: {}: '{}' must be {}, not {}. Export the level again.", file_, owner, rule.key,
                                   expected, text);
        }
    }

    const json& root_;
    const std::string& file_;
    std::string problem_;
};

}  // namespace

Expected<void> checkTypes(std::string_view gltf_json, const std::string& file) {
    const json root = json::parse(gltf_json, nullptr, false);
    if (!root.is_object()) return {};
    return TypeChecker(root, file).run();
}

}  // namespace dimmer::cook
