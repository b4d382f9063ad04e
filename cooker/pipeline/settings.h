// The list of all settings of a profile: keys, ranges, units and what they are for. Profiles, levels, the command line,
// packs and the schema all go by it.
#pragma once

#include <pipeline/profile.h>

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace dimmer::cook {

struct Setting {
    std::string key;  // dotted: "lightmaps.page_size"
    std::variant<uint64_t*, uint32_t*, float*, ColorFormat*, DirectionModel*, GridMode*> target;
    double least = 0, most = 0;  // of a number
    std::string_view what;       // with its unit, and why one would change it
};

// Those of `profile`, whose members the targets point into.
std::vector<Setting> settingsOf(Profile& profile);

// What it is set to, as JSON: a number by shortDecimal(), a choice by its name.
nlohmann::json valueOf(const Setting& setting);

// The shortest decimal that reads back as the same float: 0.01, not 0.009999999776482582.
double shortDecimal(float value);

// "records.thresholds.NAME" is a setting for every light set.
inline constexpr std::string_view set_threshold_prefix = "records.thresholds.";

// Whether `key` stands for several settings: an object in a profile.
bool isGroupOfSettings(const std::string& key, const std::vector<Setting>& settings);

// Sets one; `settings` are settingsOf(profile). `source` begins error messages: "profile mine.json:3", "--set", "the
// level's 'dimmer_settings'".
Expected<void> assignSetting(Profile& profile, const std::vector<Setting>& settings, const std::string& key,
                             const nlohmann::json& value, const std::string& source);

// "key=value" as on the command line; numbers and names need no quotes.
Expected<void> assignText(Profile& profile, const std::string& text, const std::string& source,
                          const std::string& origin);

// The JSON schema of profiles (draft 2020-12): profiles/schema.json. Its defaults are those of the profile that all
// others start from.
std::string settingsSchema();

}  // namespace dimmer::cook
