#include <pipeline/profile.h>

#include <shipped_profiles.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <variant>

namespace dimmer::cook {
namespace {

using nlohmann::json;

constexpr int extends_depth_max = 8;

struct Setting {
    std::string key;
    std::variant<uint64_t*, uint32_t*, float*> target;
    double least, most;
};

std::vector<Setting> settingsOf(Profile& p) {
    constexpr double any_bytes = 1e15;
    std::vector<Setting> list = {
        {"budgets.total", &p.budget_total, 0, any_bytes},
        {"budgets.base_lightmaps", &p.budget_base_lightmaps, 0, any_bytes},
        {"budgets.dynamic", &p.budget_dynamic, 0, any_bytes},
        {"budgets.per_element", &p.budget_per_element, 0, any_bytes},
        {"lightmaps.texels_per_metre", &p.texels_per_metre, 0.01, 256},
        {"lightmaps.page_size", &p.page_size, 64, 4096},
        {"records.threshold", &p.threshold, 0, 1},
    };
    for (auto [name, q] : {std::pair{"draft", &p.draft}, {"preview", &p.preview}, {"final", &p.final}}) {
        const std::string prefix = fmt::format("bake.{}.", name);
        list.push_back({prefix + "samples_per_texel", &q->samples_per_texel, 1, 64});
        list.push_back({prefix + "series_rays", &q->series_rays, 1, 4096});
        list.push_back({prefix + "rays", &q->rays, 1, 1 << 20});
        list.push_back({prefix + "emitter_samples", &q->emitter_samples, 0, 4096});
        list.push_back({prefix + "noise", &q->noise, 0, 1});
        list.push_back({prefix + "denoise", &q->denoise, 0, 1});
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

Expected<void> assign(const Setting& setting, const json& value, const std::string& source) {
    if (!value.is_number()) return bad(source, fmt::format("'{}' must be a number", setting.key));
    const double number = value.get<double>();
    if (!(number >= setting.least && number <= setting.most))
        return bad(source,
                   fmt::format("'{}' is {}, outside {} .. {}", setting.key, number, setting.least, setting.most));
    const bool whole = !std::holds_alternative<float*>(setting.target);
    if (whole && number != std::floor(number))
        return bad(source, fmt::format("'{}' is {}, it must be a whole number", setting.key, number));
    std::visit([&](auto* target) { *target = static_cast<std::remove_pointer_t<decltype(target)>>(number); },
               setting.target);
    return {};
}

Expected<void> apply(Profile& profile, const std::string& name_or_file, int depth);

Expected<void> applyText(Profile& profile, const std::string& text, const std::string& source, int depth) {
    const json root = json::parse(text, nullptr, false);
    if (root.is_discarded() || !root.is_object()) return bad(source, "this is not a JSON object");
    if (root.contains("extends")) {
        if (!root["extends"].is_string()) return bad(source, "'extends' must be a profile's name");
        if (depth >= extends_depth_max) return bad(source, "profiles extend one another in a circle");
        if (auto ok = apply(profile, root["extends"].get<std::string>(), depth + 1); !ok) return ok;
    }
    const auto settings = settingsOf(profile);
    std::map<std::string, json> values;
    flatten(root, "", values);
    for (const auto& [key, value] : values) {
        if (key == "extends" || key == "description") continue;
        const auto it = std::ranges::find(settings, key, &Setting::key);
        if (it == settings.end()) {
            std::vector<std::string> known;
            for (const Setting& s : settings) known.push_back(s.key);
            return bad(source, fmt::format("'{}' is no setting; there are: {}", key, fmt::join(known, ", ")));
        }
        if (auto ok = assign(*it, value, source); !ok) return ok;
        profile.origin[key] = source;
    }
    return {};
}

Expected<void> apply(Profile& profile, const std::string& name_or_file, int depth) {
    for (const auto& [name, text] : shipped_profiles)
        if (name == name_or_file) return applyText(profile, std::string(text), std::string(name), depth);
    std::ifstream file(name_or_file, std::ios::binary);
    if (!file || std::filesystem::is_directory(name_or_file))
        return fail(ErrorCode::NotFound, fmt::format("there is no profile '{}': give a file or one of {}", name_or_file,
                                                     fmt::join(shippedProfiles(), ", ")));
    std::stringstream text;
    text << file.rdbuf();
    return applyText(profile, text.str(), name_or_file, depth);
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
    out["quality"] = {{"value", quality}, {"from", "command line"}};
    for (const Setting& s : settingsOf(copy)) {
        if (s.key.starts_with("bake.") && !s.key.starts_with("bake." + quality + ".")) continue;
        const auto from = origin.find(s.key);
        std::visit(
            [&](auto* v) {
                out[s.key] = {{"value", *v}, {"from", from == origin.end() ? "default" : from->second}};
            },
            s.target);
    }
    return out.dump();
}

Expected<Profile> loadProfile(const std::string& name_or_file) {
    Profile profile;
    if (auto ok = apply(profile, name_or_file, 0); !ok) return std::unexpected(ok.error());
    return profile;
}

std::vector<std::string> shippedProfiles() {
    std::vector<std::string> names;
    for (const auto& [name, text] : shipped_profiles) names.emplace_back(name);
    return names;
}

}  // namespace dimmer::cook
