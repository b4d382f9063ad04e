#include <pipeline/profile.h>

#include <shipped_profiles.h>
#include <update/state_text.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <variant>

namespace dimmer::cook {
namespace {

using nlohmann::json;

constexpr int extends_depth_max = 8;
constexpr const char* base_profile = "desktop";

struct Setting {
    std::string key;
    std::variant<uint64_t*, uint32_t*, float*, ColorFormat*, DirectionModel*> target;
    double least = 0, most = 0;  // of a number
};

// The names of a choice's values, by value.
constexpr std::array color_formats = {"r11g11b10f", "e5b9g9r9"};
constexpr std::array direction_models = {"ahd", "linear"};
constexpr const auto& namesOf(ColorFormat) {
    return color_formats;
}
constexpr const auto& namesOf(DirectionModel) {
    return direction_models;
}

std::vector<Setting> settingsOf(Profile& p) {
    constexpr double any_bytes = 1e15;
    std::vector<Setting> list = {
        {"budgets.total", &p.budget_total, 0, any_bytes},
        {"budgets.base_lightmaps", &p.budget_base_lightmaps, 0, any_bytes},
        {"budgets.dynamic", &p.budget_dynamic, 0, any_bytes},
        {"budgets.per_element", &p.budget_per_element, 0, any_bytes},
        {"lightmaps.texels_per_metre", &p.texels_per_metre, 0.01, 256},
        {"lightmaps.page_size", &p.page_size, 64, 4096},
        {"lightmaps.color", &p.color_format},
        {"lightmaps.model", &p.direction_model},
        {"records.threshold", &p.threshold, 0, 1},
        {"grids.probes_max", &p.probes_max, 0, 1 << 20},
        {"grids.global_min_spacing", &p.global_min_spacing_m, 0.1, 1000},
        {"grids.local_spacing", &p.local_spacing_m, 0.1, 100},
    };
    for (auto [name, q] : {std::pair{"draft", &p.draft}, {"preview", &p.preview}, {"final", &p.final}}) {
        const std::string prefix = fmt::format("bake.{}.", name);
        list.push_back({prefix + "samples_per_texel", &q->samples_per_texel, 1, 64});
        list.push_back({prefix + "series_rays", &q->series_rays, 1, 4096});
        list.push_back({prefix + "rays", &q->rays, 1, 1 << 20});
        list.push_back({prefix + "emitter_samples", &q->emitter_samples, 0, 4096});
        list.push_back({prefix + "noise", &q->noise, 0, 1});
        list.push_back({prefix + "denoise", &q->denoise, 0, 1});
        list.push_back({prefix + "probe_sites", &q->probe_sites, 1, 256});
        list.push_back({prefix + "bounces", &q->bounces, 1, 1024});
        list.push_back({prefix + "tolerance", &q->tolerance, 1e-6, 1});
    }
    return list;
}

std::unexpected<Error> bad(const std::string& source, const std::string& text) {
    return fail(ErrorCode::BadInput, fmt::format("profile {}: {}", source, text));
}

// Flattens nested objects to dotted keys.
void flatten(const json& object, const std::string& prefix, std::map<std::string, json>& out) {
    for (const auto& [key, value] : object.items()) {
        const std::string path = prefix.empty() ? key : prefix + "." + key;
        if (value.is_object())
            flatten(value, path, out);
        else
            out[path] = value;
    }
}

template <class Choice>
Expected<void> choose(const Setting& setting, Choice& target, const json& value, const std::string& source) {
    const auto& names = namesOf(Choice{});
    const auto name = value.is_string() ? std::ranges::find(names, value.get<std::string>()) : names.end();
    if (name == names.end())
        return bad(source, fmt::format("'{}' must be one of \"{}\"", setting.key, fmt::join(names, "\", \"")));
    target = static_cast<Choice>(name - names.begin());
    return {};
}

Expected<void> assignNumber(const Setting& setting, const json& value, const std::string& source) {
    if (!value.is_number()) return bad(source, fmt::format("'{}' must be a number", setting.key));
    const double number = value.get<double>();
    if (!(number >= setting.least && number <= setting.most))
        return bad(source,
                   fmt::format("'{}' is {}, outside {} .. {}", setting.key, number, setting.least, setting.most));
    const bool whole = !std::holds_alternative<float*>(setting.target);
    if (whole && number != std::floor(number))
        return bad(source, fmt::format("'{}' is {}, it must be a whole number", setting.key, number));
    std::visit(
        [&](auto* target) {
            if constexpr (std::is_arithmetic_v<std::remove_pointer_t<decltype(target)>>)
                *target = static_cast<std::remove_pointer_t<decltype(target)>>(number);
        },
        setting.target);
    return {};
}

Expected<void> assign(const Setting& setting, const json& value, const std::string& source) {
    if (const auto* format = std::get_if<ColorFormat*>(&setting.target))
        return choose(setting, **format, value, source);
    if (const auto* model = std::get_if<DirectionModel*>(&setting.target))
        return choose(setting, **model, value, source);
    return assignNumber(setting, value, source);
}

// "'lightmaps.page_sice' is no setting; did you mean 'lightmaps.page_size'?"
std::string unknownKey(const std::string& key, const json& value, const std::vector<Setting>& settings) {
    const bool group = std::ranges::any_of(settings, [&](const Setting& s) { return s.key.starts_with(key + "."); });
    if (group) return fmt::format("'{}' must be an object, not {}", key, value.type_name());
    std::vector<std::string_view> known = {"extends", "description"};
    for (const Setting& s : settings) known.push_back(s.key);
    if (const std::string_view nearest = nearestName(key, known); !nearest.empty())
        return fmt::format("'{}' is no setting; did you mean '{}'?", key, nearest);
    return fmt::format("'{}' is no setting; there are: {}", key, fmt::join(known, ", "));
}

// A JSON document with where it stands.
struct Source {
    std::string name;    // for messages: a shipped profile's name, or the file as given
    std::string origin;  // for the pack: without folders, so that the same cook gives the same bytes everywhere
    std::filesystem::path folder;  // what `extends` may be relative to
    std::string text;
};

// A profile nests three deep ("bake", "draft", "rays"). What goes deeper is not built: the library follows it with one
// stack frame per level.
constexpr int nesting_max = 3;

Expected<json> parseObject(const Source& source) {
    bool too_deep = false;
    const auto shallow = [&](int depth, json::parse_event_t event, const json&) {
        const bool start = event == json::parse_event_t::object_start || event == json::parse_event_t::array_start;
        too_deep = too_deep || (start && depth >= nesting_max);
        return !too_deep;
    };
    try {
        json root = json::parse(source.text, shallow);
        if (too_deep) return bad(source.name, "it nests deeper than any setting");
        if (root.is_object()) return root;
        return bad(source.name, fmt::format("a JSON object was expected, not {}", root.type_name()));
    } catch (const json::exception& error) {
        // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
        const std::string_view text = error.what();
        return bad(source.name, fmt::format("this is not JSON: {}", text.substr(text.find("] ") + 2)));
    }
}

Expected<Source> findSource(const std::string& name_or_file, const std::filesystem::path& folder) {
    for (const auto& [name, text] : shipped_profiles)
        if (name == name_or_file) return Source{std::string(name), std::string(name), {}, std::string(text)};
    const std::filesystem::path path = folder / name_or_file;
    std::ifstream file(path, std::ios::binary);
    if (!file || std::filesystem::is_directory(path)) {
        const auto shipped = shippedProfiles();
        const std::string_view nearest = nearestName(name_or_file, {shipped.begin(), shipped.end()});
        return fail(
            ErrorCode::NotFound,
            fmt::format("there is no profile '{}': give a file or one of {}{}", path.string(), fmt::join(shipped, ", "),
                        nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
    }
    std::stringstream text;
    text << file.rdbuf();
    return Source{path.string(), path.filename().string(), path.parent_path(), text.str()};
}

Expected<void> apply(Profile& profile, const Source& source, int depth);

// The profile that this one starts from: what it names, else the default one.
Expected<void> applyBase(Profile& profile, const json& root, const Source& source, int depth) {
    if (!root.contains("extends") && source.name == base_profile) return {};
    const json extends = root.value("extends", json(base_profile));
    if (!extends.is_string()) return bad(source.name, "'extends' must be a shipped profile's name or a file");
    if (depth >= extends_depth_max) return bad(source.name, "profiles extend one another in a circle");
    const auto base = findSource(extends.get<std::string>(), source.folder);
    if (!base) return bad(source.name, "'extends': " + base.error().message);
    return apply(profile, *base, depth + 1);
}

Expected<void> apply(Profile& profile, const Source& source, int depth) {
    const auto root = parseObject(source);
    if (!root) return std::unexpected(root.error());
    if (auto ok = applyBase(profile, *root, source, depth); !ok) return ok;
    const auto settings = settingsOf(profile);
    std::map<std::string, json> values;
    flatten(*root, "", values);
    for (const auto& [key, value] : values) {
        if (key == "extends" || key == "description") continue;
        const auto it = std::ranges::find(settings, key, &Setting::key);
        if (it == settings.end()) return bad(source.name, unknownKey(key, value, settings));
        if (auto ok = assign(*it, value, source.name); !ok) return ok;
        profile.origin[key] = source.origin;
    }
    return {};
}

// The shortest decimal that reads back as the same float: 0.01, not 0.009999999776482582.
double shortDecimal(float value) {
    return std::stod(fmt::format("{}", value));
}

}  // namespace

const char* nameOf(ColorFormat format) {
    return color_formats[static_cast<size_t>(format)];
}

const char* nameOf(DirectionModel model) {
    return direction_models[static_cast<size_t>(model)];
}

const Quality* Profile::quality(const std::string& name) const {
    if (name == "draft") return &draft;
    if (name == "preview") return &preview;
    if (name == "final") return &final;
    return nullptr;
}

std::string Profile::settingsJson(const std::string& quality) const {
    Profile copy = *this;
    nlohmann::ordered_json out;
    out["quality"] = {{"value", quality}, {"from", "command line"}};
    for (const Setting& s : settingsOf(copy)) {
        if (s.key.starts_with("bake.") && !s.key.starts_with("bake." + quality + ".")) continue;
        const auto from = origin.find(s.key);
        std::visit(
            [&](auto* v) {
                auto& setting = out[s.key];
                if constexpr (std::is_same_v<decltype(v), float*>)
                    setting["value"] = shortDecimal(*v);
                else if constexpr (std::is_enum_v<std::remove_pointer_t<decltype(v)>>)
                    setting["value"] = nameOf(*v);
                else
                    setting["value"] = *v;
                setting["from"] = from == origin.end() ? "default" : from->second;
            },
            s.target);
    }
    return out.dump();
}

Expected<CookSettings> readSettings(const std::string& settings_json) {
    const std::string source = "of the pack";
    const auto root = parseObject({source, source, {}, settings_json});
    if (!root) return std::unexpected(root.error());
    CookSettings out;
    const auto settings = settingsOf(out.profile);
    for (const auto& [key, setting] : root->items()) {
        if (!setting.is_object() || !setting.contains("value"))
            return bad(source, fmt::format("'{}' has no value", key));
        const json& value = setting["value"];
        if (key == "quality" && value.is_string()) out.quality = value.get<std::string>();
        const auto it = std::ranges::find(settings, key, &Setting::key);
        if (it == settings.end()) continue;
        if (auto ok = assign(*it, value, source); !ok) return std::unexpected(ok.error());
    }
    if (!out.profile.quality(out.quality))
        return bad(source, "no quality is named; the pack was not cooked from a level");
    return out;
}

Expected<Profile> loadProfile(const std::string& name_or_file) {
    const auto source = findSource(name_or_file, {});
    if (!source) return std::unexpected(source.error());
    Profile profile;
    if (auto ok = apply(profile, *source, 0); !ok) return std::unexpected(ok.error());
    return profile;
}

std::vector<std::string> shippedProfiles() {
    std::vector<std::string> names;
    for (const auto& [name, text] : shipped_profiles) names.emplace_back(name);
    return names;
}

}  // namespace dimmer::cook
