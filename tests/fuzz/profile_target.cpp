// Profiles, and the settings that packs carry: the same keys in another shape.
#include <fuzz/input_file.h>
#include <fuzz/target.h>
#include <pipeline/profile.h>
#include <xxhash.h>

#include <array>
#include <cmath>
#include <utility>

namespace dimmer::fuzz {
namespace {

// Most changed inputs leave most settings as they were: reading the same text again would tell nothing.
bool readBefore(const std::string& text) {
    static std::array<uint64_t, 65536> hashes = {};  // the latest of each slot
    const uint64_t hash = XXH3_64bits(text.data(), text.size());
    return std::exchange(hashes[hash % hashes.size()], hash) == hash;
}

void checkProfile(const cook::Profile& profile) {
    require(profile.texels_per_metre > 0 && std::isfinite(profile.texels_per_metre), "a density is positive");
    require(profile.threshold >= 0 && profile.threshold <= 1, "a threshold is a share");
    require(profile.page_size >= 64 && profile.page_size <= 4096, "a page has its limits");
    for (const char* name : {"draft", "preview", "final"}) {
        const cook::Quality* quality = profile.quality(name);
        require(quality && quality->samples_per_texel > 0 && quality->rays > 0, "every quality traces rays");
        const std::string settings = profile.settingsJson(name);
        if (readBefore(settings)) continue;
        const auto again = cook::readSettings(settings);
        require(again && again->quality == name, "settings that were written can be read");
    }
}

}  // namespace

void runProfile(Input input) {
    static const InputFile file("fuzz.json");
    file.write(input);
    const auto profile = cook::loadProfile(file.path().string());
    if (profile)
        checkProfile(*profile);
    else
        require(profile.error().message.find("fuzz.json") != std::string::npos, "an error names the file");
    if (const auto settings = cook::readSettings(std::string(textOf(input))); !settings)
        require(!settings.error().message.empty(), "an error says something");
}

std::vector<Bytes> profileSeeds() {
    std::vector<Bytes> seeds;
    for (const char* text :
         {R"({"extends": "console", "description": "a test", "budgets": {"total": 1e6, "per_element": 2000000}})",
          R"({"lightmaps": {"texels_per_metre": 6.5, "page_size": 1024, "color": "e5b9g9r9", "model": "linear"}})",
          R"({"records": {"threshold": 0.02}, "bake": {"draft": {"rays": 32, "noise": 0.1, "tolerance": 0.01}}})",
          R"({"bake": {"final": {"samples_per_texel": 2, "series_rays": 8, "emitter_samples": 2, "bounces": 8}}})",
          R"({"budgets": {"total": -1}, "lightmaps": {"color": 3}, "page_sice": null})"})
        seeds.push_back(bytesOf(text));
    const auto desktop = cook::loadProfile("desktop");
    require(desktop.has_value(), "a shipped profile can be read");
    seeds.push_back(bytesOf(desktop->settingsJson("draft")));
    return seeds;
}

}  // namespace dimmer::fuzz
