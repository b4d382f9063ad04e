#include <pipeline/profile.h>

#include <pipeline/json_lines.h>
#include <pipeline/settings.h>
#include <shipped_profiles.h>
#include <update/state_text.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

namespace dimmer::cook {
namespace {

using nlohmann::json;

constexpr int extends_depth_max = 8;
constexpr const char* base_profile = "desktop";

std::unexpected<Error> badProfile(const std::string& source, const std::string& text) {
    return fail(ErrorCode::BadInput, fmt::format("profile {}: {}", source, text));
}

// Flattens nested objects to dotted keys; empty ones stay what they are. Returns a key that is there twice, or nothing.
std::string flatten(const json& object, const std::string& prefix, std::map<std::string, json>& out) {
    std::string twice;
    for (const auto& [key, value] : object.items()) {
        const std::string path = prefix.empty() ? key : prefix + "." + key;
        if (value.is_object() && !value.empty())
            twice = std::max(twice, flatten(value, path, out));
        else if (!out.emplace(path, value).second)
            twice = path;
    }
    return twice;
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

// The library keeps the last of two equal keys.
class KeysOnce {
   public:
    void see(json::parse_event_t event, const json& parsed) {
        if (event == json::parse_event_t::object_start) open_.push_back({open_.empty() ? "" : last_ + ".", {}});
        if (event == json::parse_event_t::object_end && !open_.empty()) open_.pop_back();
        if (event != json::parse_event_t::key || open_.empty()) return;
        const auto key = parsed.get<std::string>();
        last_ = open_.back().prefix + key;
        if (!open_.back().keys.insert(key).second && twice_.empty()) twice_ = last_;
    }
    const std::string& twice() const { return twice_; }  // dotted

   private:
    struct Object {
        std::string prefix;
        std::set<std::string> keys;
    };
    std::vector<Object> open_;
    std::string last_, twice_;
};

std::string placeOf(const std::string& key, const Source& source) {
    const auto lines = linesOfKeys(source.text);
    const auto line = lines.find(key);
    return line == lines.end() ? source.name : fmt::format("{}:{}", source.name, line->second);
}

std::unexpected<Error> isTwice(const std::string& key, const Source& source) {
    return badProfile(placeOf(key, source), fmt::format("'{}' is there twice", key));
}

Expected<json> parseObject(const Source& source) {
    bool too_deep = false;
    KeysOnce keys;
    const auto shallow = [&](int depth, json::parse_event_t event, const json& parsed) {
        const bool start = event == json::parse_event_t::object_start || event == json::parse_event_t::array_start;
        too_deep = too_deep || (start && depth >= nesting_max);
        if (!too_deep) keys.see(event, parsed);
        return !too_deep;
    };
    try {
        json root = json::parse(source.text, shallow);
        if (too_deep) return badProfile(source.name, "it nests deeper than any setting");
        if (!keys.twice().empty()) return isTwice(keys.twice(), source);
        if (root.is_object()) return root;
        return badProfile(source.name, fmt::format("a JSON object was expected, not {}", root.type_name()));
    } catch (const json::exception& error) {
        // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
        const std::string_view text = error.what();
        return badProfile(source.name, fmt::format("this is not JSON: {}", text.substr(text.find("] ") + 2)));
    }
}

Expected<Source> findSource(const std::string& name_or_file, const std::filesystem::path& folder) {
    for (const auto& [name, text] : shipped_profiles)
        if (name == name_or_file) return Source{std::string(name), std::string(name), {}, std::string(text)};
    const std::filesystem::path path = folder / name_or_file;
    std::error_code ignored;
    // Not what never ends, as pipes and devices do.
    const bool usable = std::filesystem::is_regular_file(path, ignored);
    std::ifstream file(usable ? path : std::filesystem::path(), std::ios::binary);
    if (!file && usable) return fail(ErrorCode::Io, fmt::format("profile {}: it cannot be opened", path.string()));
    if (!file) {
        const auto shipped = shippedProfiles();
        const std::string names = fmt::format("{}", fmt::join(shipped, ", "));
        if (std::filesystem::exists(path, ignored))
            return fail(
                ErrorCode::NotFound,
                fmt::format("profile {}: a profile must be a regular file, no folder, pipe or device: give one, "
                            "or one of {}",
                            path.string(), names));
        const std::string_view nearest = nearestName(name_or_file, {shipped.begin(), shipped.end()});
        return fail(ErrorCode::NotFound,
                    fmt::format("there is no profile '{}': give a file or one of {}{}", path.string(), names,
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
    const auto bad = [&](const std::string& text) { return badProfile(placeOf("extends", source), text); };
    if (!extends.is_string()) return bad("'extends' must be a shipped profile's name or a file");
    if (depth >= extends_depth_max) return bad("profiles extend one another in a circle");
    const auto base = findSource(extends.get<std::string>(), source.folder);
    if (!base) return bad("'extends': " + base.error().message);
    return apply(profile, *base, depth + 1);
}

Expected<void> apply(Profile& profile, const Source& source, int depth) {
    const auto root = parseObject(source);
    if (!root) return std::unexpected(root.error());
    if (auto ok = applyBase(profile, *root, source, depth); !ok) return ok;
    std::map<std::string, json> values;
    if (const std::string twice = flatten(*root, "", values); !twice.empty()) return isTwice(twice, source);
    const auto settings = settingsOf(profile);
    for (const auto& [key, value] : values) {
        if (key == "extends") continue;
        if (key == "description" || key == "$schema") {
            if (value.is_string()) continue;
            return badProfile(placeOf(key, source), fmt::format("'{}' must be a text, not {}", key, value.type_name()));
        }
        if (value.is_object() && isGroupOfSettings(key, settings)) continue;  // an empty one
        const auto assign = [&](const std::string& place) {
            return assignSetting(profile, settings, key, value, "profile " + place);
        };
        if (!assign(source.name)) return assign(placeOf(key, source));  // once more, for a message that tells the line
        profile.origin[key] = source.origin;
    }
    return {};
}

}  // namespace

const Quality* Profile::quality(const std::string& name) const {
    if (name == "draft") return &draft;
    if (name == "preview") return &preview;
    if (name == "final") return &final;
    return nullptr;
}

std::string Profile::settingsJson(const std::string& quality) const {
    Profile copy = *this;
    nlohmann::ordered_json out;
    const auto of_quality = origin.find("quality");
    out["quality"] = {{"value", quality}, {"from", of_quality == origin.end() ? "default" : of_quality->second}};
    for (const Setting& s : settingsOf(copy)) {
        if (s.key.starts_with("bake.") && !s.key.starts_with("bake." + quality + ".")) continue;
        const auto from = origin.find(s.key);
        out[s.key] = {{"value", valueOf(s)}, {"from", from == origin.end() ? "default" : from->second}};
    }
    for (const auto& [set, share] : set_thresholds) {
        const std::string key = std::string(set_threshold_prefix) + set;
        const auto from = origin.find(key);
        out[key] = {{"value", shortDecimal(share)}, {"from", from == origin.end() ? "default" : from->second}};
    }
    // A file's name, which is where a setting may come from, need not be UTF-8.
    return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Expected<CookSettings> readSettings(const std::string& settings_json) {
    const std::string source = "of the pack";
    const auto root = parseObject({source, source, {}, settings_json});
    if (!root) return std::unexpected(root.error());
    CookSettings out;
    const auto settings = settingsOf(out.profile);
    for (const auto& [key, setting] : root->items()) {
        if (!setting.is_object() || !setting.contains("value"))
            return badProfile(source, fmt::format("'{}' has no value", key));
        const json& value = setting["value"];
        if (key == "quality" && value.is_string()) out.quality = value.get<std::string>();
        const bool known = std::ranges::find(settings, key, &Setting::key) != settings.end();
        if (!known && !key.starts_with(set_threshold_prefix)) continue;
        if (auto ok = assignSetting(out.profile, settings, key, value, "profile " + source); !ok)
            return std::unexpected(ok.error());
    }
    if (!out.profile.quality(out.quality))
        return badProfile(source, "no quality is named; the pack was not cooked from a level");
    return out;
}

nlohmann::ordered_json listedSettings(const std::string& settings_json) {
    using Json = nlohmann::ordered_json;
    const auto shallow = [](int depth, Json::parse_event_t event, const Json&) {
        return depth < 2 || (event != Json::parse_event_t::object_start && event != Json::parse_event_t::array_start);
    };
    const Json all = Json::parse(settings_json, shallow, false);
    Json settings = Json::object();
    if (!all.is_object()) return settings;
    for (const auto& [key, setting] : all.items()) {
        if (!setting.is_object() || !setting.contains("value") || !setting.contains("from")) continue;
        const auto &value = setting["value"], &from = setting["from"];
        if (value.is_primitive() && from.is_string()) settings[key] = {{"value", value}, {"from", from}};
    }
    return settings;
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

bool hidesFile(const std::string& name) {
    std::error_code ignored;
    const auto shipped = shippedProfiles();
    return std::ranges::find(shipped, name) != shipped.end() && std::filesystem::is_regular_file(name, ignored);
}

std::vector<std::filesystem::path> filesExtendedBy(const std::string& name_or_file) {
    const auto shipped = shippedProfiles();
    std::vector<std::filesystem::path> files;
    auto source = findSource(name_or_file, {});
    for (int depth = 0; source && depth < extends_depth_max; ++depth) {
        const auto root = parseObject(*source);
        if (!root || !root->contains("extends") || !root->at("extends").is_string()) break;
        source = findSource(root->at("extends").get<std::string>(), source->folder);
        if (source && std::ranges::find(shipped, source->name) == shipped.end()) files.emplace_back(source->name);
    }
    return files;
}

}  // namespace dimmer::cook
