#include <scene/json_types.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <span>

namespace dimmer::cook {
namespace {

using nlohmann::json;

enum class Kind { Index, Indices, Whole, Number, Numbers, Text, Flag, Object, IndexOfEach };

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
    {"attributes", Kind::IndexOfEach}, {"indices", Kind::Index}, {"material", Kind::Index}, {"mode", Kind::Whole}};
constexpr Rule of_accessor[] = {{"bufferView", Kind::Index}, {"byteOffset", Kind::Whole},
                                {"count", Kind::Whole},      {"type", Kind::Text},
                                {"normalized", Kind::Flag},  {"componentType", Kind::Whole}};
constexpr Rule of_view[] = {
    {"buffer", Kind::Index}, {"byteOffset", Kind::Whole}, {"byteLength", Kind::Whole}, {"byteStride", Kind::Whole}};
constexpr Rule of_material[] = {{"pbrMetallicRoughness", Kind::Object}, {"emissiveFactor", Kind::Numbers, 3},
                                {"emissiveTexture", Kind::Object},      {"alphaMode", Kind::Text},
                                {"alphaCutoff", Kind::Number},          {"doubleSided", Kind::Flag}};
constexpr Rule of_surface[] = {{"baseColorFactor", Kind::Numbers, 4},
                               {"baseColorTexture", Kind::Object},
                               {"metallicFactor", Kind::Number},
                               {"roughnessFactor", Kind::Number}};
constexpr Rule of_texture_info[] = {{"index", Kind::Index}, {"texCoord", Kind::Whole}};
constexpr Rule of_texture[] = {{"source", Kind::Index}, {"sampler", Kind::Index}};
constexpr Rule of_image[] = {{"bufferView", Kind::Index}, {"uri", Kind::Text}, {"mimeType", Kind::Text}};

// -1 is what the parser has for none; other negative ones are told with what they refer to (gltf_check.h).
bool isIndex(const json& v) {
    return v.is_number_unsigned() || (v.is_number_integer() && v.get<int64_t>() != -1);
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
            return unless(isIndex(v), "an index from 0");
        case Kind::Indices:
            return unless(v.is_array() && all(v, isIndex), "a list of indices from 0");
        case Kind::IndexOfEach:
            return unless(v.is_object() && all(v, isIndex), "an object of indices from 0");
        case Kind::Whole:
            return unless(isWhole(v), "a whole number from 0");
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
        forEach("scenes", "scene", of_scene);
        forEach("nodes", "node", of_node);
        forEach("accessors", "accessor", of_accessor);
        forEach("bufferViews", "buffer view", of_view);
        forEach("textures", "texture", of_texture);
        forEach("images", "image", of_image);
        forEach("meshes", "mesh", {}, [&](const json& mesh, const std::string& owner) {
            if (const auto primitives = mesh.find("primitives"); primitives != mesh.end() && primitives->is_array())
                for (const json& p : *primitives) object(p, owner, of_primitive);
        });
        forEach("materials", "material", of_material, [&](const json& material, const std::string& owner) {
            inner(material, "emissiveTexture", owner, of_texture_info);
            const auto surface = material.find("pbrMetallicRoughness");
            if (surface == material.end()) return;
            object(*surface, owner, of_surface);
            inner(*surface, "baseColorTexture", owner, of_texture_info);
        });
        if (problem_.empty()) return {};
        return fail(ErrorCode::BadInput, problem_);
    }

   private:
    void forEach(const char* list, const char* what, std::span<const Rule> rules, auto&& more) {
        const auto found = root_.find(list);
        if (found == root_.end() || !found->is_array()) return;
        for (size_t i = 0; i < found->size() && problem_.empty(); ++i) {
            const json& item = (*found)[i];
            const auto name = item.is_object() ? item.find("name") : item.end();
            const bool named = item.is_object() && name != item.end() && name->is_string() && *name != "";
            // As ImportContext labels them.
            const std::string owner =
                named ? fmt::format("{} '{}'", what, name->get<std::string>()) : fmt::format("{} {}", what, i);
            object(item, owner, rules);
            if (item.is_object()) more(item, owner);
        }
    }
    void forEach(const char* list, const char* what, std::span<const Rule> rules) {
        forEach(list, what, rules, [](const json&, const std::string&) {});
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
