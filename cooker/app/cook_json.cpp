#include <app/budget_json.h>
#include <app/cook_json.h>
#include <app/files.h>
#include <app/pack_id.h>
#include <dimmer/version.h>
#include <pipeline/settings.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

namespace dimmer::cook {
namespace {

using Json = nlohmann::ordered_json;

Json cacheJson(const CookStats& stats) {
    auto list = Json::array();
    for (const CacheLine& line : stats.cache)
        list.push_back({{"stage", line.what}, {"reused", line.reused}, {"why", line.why}});
    return list;
}

double fourDigits(double value) {
    return std::stod(fmt::format("{:.4g}", value));
}

Json remedyJson(const Remedy& remedy) {
    Json changes;
    for (const Change& c : remedy.changes) changes[c.key] = shortDecimal(c.to);
    return {{"changes", changes},
            {"options", remedy.options()},
            {"saves", remedy.saves},
            {"fits", remedy.fits},
            {"energy", fourDigits(remedy.energy)},
            {"energy_of", remedy.energy > 0 ? Json(remedy.energy_of) : Json(nullptr)},
            {"error", remedy.texels ? Json(fourDigits(remedy.error)) : Json(nullptr)},
            {"moves_light", remedy.moves_light},
            {"grid_error", remedy.grid_error ? Json(fourDigits(*remedy.grid_error)) : Json(nullptr)}};
}

Json remediesJson(const std::vector<Remedy>& remedies) {
    auto list = Json::array();
    for (const Remedy& remedy : remedies) list.push_back(remedyJson(remedy));
    return list;
}

void addTimes(const CookStats& stats, Json& json) {
    json["seconds"] = stats.seconds;
    auto& of_bake = json["bake_seconds"] = Json::object();
    for (const auto& [stage, seconds] : stats.bake_seconds) of_bake[stage] = seconds;
    json["rays"] = stats.rays;
    const auto bake = stats.seconds.find("bake");
    const bool baked = bake != stats.seconds.end() && bake->second > 0;
    json["rays_per_second"] = baked ? static_cast<double>(stats.rays) / bake->second : 0;
    json["peak_bytes"] = stats.peak_bytes;
}

}  // namespace

Json suggestionsJson(const CookStats& stats) {
    return Json(stats.suggested_combinations);
}

Json cookJson(Verdict verdict, const CookOptions& options, const std::vector<std::filesystem::path>& inputs,
              const CookResult& result) {
    const bool cooked = verdict == Verdict::Cooked;
    const PackCost cost = costOf(result.pack);
    Json json = {{"result", cooked ? "cooked" : "over_budget"},
                 {"version", DIMMER_VERSION},
                 {"level", options.level.string()},
                 {"profile", options.profile},
                 {"quality", options.quality}};
    auto& files = json["inputs"] = Json::array();
    for (const auto& input : inputs) files.push_back(input.string());
    if (cooked) json["pack_id"] = packId(result.header_hash);
    addTimes(result.stats, json);
    if (cooked) json["file_bytes"] = result.file_bytes;
    json["bytes"] = bytesJson(cost, cooked ? std::optional(result.file_bytes) : std::nullopt);
    json["budgets"] = budgetsJson(result.profile);
    json["elements"] = elementsJson(result.pack, cost);
    json["warnings"] = result.stats.warnings;
    json["cache"] = cacheJson(result.stats);
    if (!result.fitted.empty()) json["fitted"] = remediesJson(result.fitted);
    if (!cooked) json["remedies"] = remediesJson(result.remedies);
    if (!result.stats.suggested_combinations.empty()) json["dimmer_combinations"] = suggestionsJson(result.stats);
    return json;
}

Expected<void> removeCookJson(const std::string& file) {
    return removeEarlierJson(file, {"rays_per_second", "peak_bytes"});
}

}  // namespace dimmer::cook
