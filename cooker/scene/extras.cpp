#include <fmt/format.h>
#include <scene/extras.h>
#include <update/state_text.h>

#include <algorithm>
#include <array>
#include <span>

namespace dimmer::cook {
namespace {

constexpr std::array<std::string_view, 12> node_keys = {
    "dimmer_light_set",     "dimmer_max_weight",       "dimmer_bake",     "dimmer_door",    "dimmer_door_open",
    "dimmer_door_rotation", "dimmer_door_translation", "dimmer_lighting", "dimmer_dynamic", "dimmer_texel_density",
    "dimmer_grid_spacing",  "dimmer_play_area"};
constexpr std::array<std::string_view, 5> scene_keys = {"dimmer_sky_color", "dimmer_sky_luminance", "dimmer_sky_image",
                                                        "dimmer_combinations", "dimmer_settings"};

bool contains(std::span<const std::string_view> keys, std::string_view key) {
    return std::ranges::count(keys, key) > 0;
}

std::string_view nearest(std::string_view key) {
    key = key.substr(0, 64);  // longer than any key; bounds the work for absurd ones
    std::string_view best = node_keys[0];
    size_t best_distance = editDistance(key, best);
    const auto consider = [&](std::string_view candidate) {
        const size_t distance = editDistance(key, candidate);
        if (distance < best_distance) best = candidate, best_distance = distance;
    };
    std::ranges::for_each(node_keys, consider);
    std::ranges::for_each(scene_keys, consider);
    return best;
}

// "Dimmer light-set" is a slip of who types into an editor's field.
std::string asKeysAreWritten(std::string key) {
    for (char& c : key) c = c == ' ' || c == '-' ? '_' : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return key;
}

bool isFiniteNumber(const tinygltf::Value& value) {
    return value.IsNumber() && isFiniteFloat(value.GetNumberAsDouble());
}

}  // namespace

void Extras::add(const tinygltf::Value& values, std::string owner) {
    if (values.IsObject()) sources_.push_back({&values, std::move(owner)});
}

const Extras::Source* Extras::find(std::string_view key) const {
    const std::string name(key);
    const auto source = std::ranges::find_if(sources_, [&](const Source& s) { return s.values->Has(name); });
    return source == sources_.end() ? nullptr : &*source;
}

const tinygltf::Value* Extras::raw(std::string_view key) const {
    const Source* source = find(key);
    return source == nullptr ? nullptr : &source->values->Get(std::string(key));
}

std::unexpected<Error> Extras::wrongType(std::string_view key, std::string_view wanted) const {
    return context_->error(ownerOf(key), fmt::format("'{}' must be {}. Correct the custom property.", key, wanted));
}

Expected<std::optional<std::string>> Extras::text(std::string_view key) const {
    const tinygltf::Value* value = raw(key);
    if (value == nullptr) return std::nullopt;
    if (!value->IsString()) return wrongType(key, "a text");
    return value->Get<std::string>();
}

Expected<std::optional<double>> Extras::number(std::string_view key) const {
    const tinygltf::Value* value = raw(key);
    if (value == nullptr) return std::nullopt;
    if (!isFiniteNumber(*value)) return wrongType(key, "a finite number");
    return value->GetNumberAsDouble();
}

Expected<std::optional<double>> Extras::positive(std::string_view key, double at_most) const {
    const auto value = number(key);
    if (value && *value && !(static_cast<float>(**value) > 0)) return wrongType(key, "a number greater than 0");
    if (value && *value && **value > at_most) return wrongType(key, fmt::format("a number of {} at most", at_most));
    return value;
}

Expected<std::optional<std::vector<double>>> Extras::numbers(std::string_view key, size_t count) const {
    const tinygltf::Value* value = raw(key);
    if (value == nullptr) return std::nullopt;
    const std::string wanted = fmt::format("a list of {} finite numbers", count);
    if (!value->IsArray() || value->ArrayLen() != count) return wrongType(key, wanted);
    std::vector<double> numbers;
    for (const tinygltf::Value& item : value->Get<tinygltf::Value::Array>()) {
        if (!isFiniteNumber(item)) return wrongType(key, wanted);
        numbers.push_back(item.GetNumberAsDouble());
    }
    return numbers;
}

Expected<bool> Extras::flag(std::string_view key) const {
    const tinygltf::Value* value = raw(key);
    if (value == nullptr) return false;
    if (value->IsBool()) return value->Get<bool>();
    if (value->IsNumber() && (value->GetNumberAsDouble() == 0 || value->GetNumberAsDouble() == 1))
        return value->GetNumberAsDouble() == 1;
    return wrongType(key, "1 or 0, true or false");
}

Expected<std::optional<size_t>> Extras::choice(std::string_view key,
                                               const std::vector<std::string_view>& choices) const {
    const auto value = text(key);
    if (!value) return std::unexpected(value.error());
    if (!*value) return std::nullopt;
    const auto found = std::ranges::find(choices, **value);
    if (found == choices.end())
        return wrongType(key, fmt::format("'{}', not '{}'", fmt::join(choices, "', '"), **value));
    return static_cast<size_t>(found - choices.begin());
}

void warnUnknownKeys(ImportContext& context, const tinygltf::Value& extras, ExtrasPlace place,
                     const std::string& owner) {
    if (extras.IsString() && extras.Get<std::string>().find("dimmer_") != std::string::npos)
        context.warn(owner, "its extras are a text and were ignored; keys are members of an object.");
    for (const std::string& key : extras.Keys()) {
        const std::string meant = asKeysAreWritten(key);
        const bool of_nodes = contains(node_keys, key), of_scenes = contains(scene_keys, key);
        const bool right = place == ExtrasPlace::Node ? of_nodes : place == ExtrasPlace::Scene && of_scenes;
        if (!meant.starts_with("dimmer_") || right) continue;
        if (of_nodes || of_scenes)
            context.warn(owner, fmt::format("'{}' has no meaning here and was ignored; it belongs in the extras of {}.",
                                            key, of_scenes ? "the scene" : "a node"));
        else
            context.warn(
                owner, fmt::format("'{}' is not a known key and was ignored; did you mean '{}'?", key, nearest(meant)));
    }
}

Expected<void> checkElementName(const ImportContext& context, const std::string& name, std::string_view key,
                                const std::string& owner) {
    // A state is written with blanks between its parts, or without.
    const bool blank_ends = name.starts_with(' ') || name.ends_with(' ');
    const bool writable = !name.empty() && !blank_ends && name.find_first_of(",=") == std::string::npos &&
                          std::ranges::none_of(name, [](unsigned char c) { return c < 0x20; });
    if (!writable)
        return context.error(owner,
                             fmt::format("'{}' is '{}', but a name needs a character, and none of ',', '=', tabs and "
                                         "line breaks, nor blanks at its ends. Rename it.",
                                         key, name));
    if (key == "dimmer_light_set" && (name == "all" || name == "always" || name.starts_with("door:")))
        return context.error(owner, fmt::format("the light set's name '{}' has a meaning of its own where states "
                                                "and contributions are written. Rename it.",
                                                name));
    return {};
}

}  // namespace dimmer::cook
