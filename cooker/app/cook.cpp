#include <app/command.h>
#include <app/terminal_progress.h>
#include <pipeline/budget.h>
#include <pipeline/cook.h>
#include <pipeline/write_level.h>
#include <write/pack_writer.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

namespace dimmer::cook {
namespace {

struct Arguments {
    CookOptions options;
    std::string json;
    std::string write_level;
    bool suggest_combinations = false;
};

std::string share(uint64_t bytes, uint64_t budget) {
    return budget == 0
               ? ""
               : fmt::format("{:5.1f} % of {}", 100.0 * static_cast<double>(bytes) / static_cast<double>(budget),
                             humanBytes(budget));
}

void printTable(const CookResult& result, const PackCost& cost, const Profile& profile) {
    const PackData& pack = result.pack;
    fmt::print("{:<26} {:>12}  {}\n", "category", "bytes", "share of the budget");
    auto row = [](std::string_view name, uint64_t bytes, uint64_t budget) {
        fmt::print("{:<26} {:>12}  {}\n", name, humanBytes(bytes), share(bytes, budget));
    };
    row("base lightmaps", cost.base_lightmap, profile.budget_base_lightmaps);
    row("dynamic records", cost.dynamic, profile.budget_dynamic);
    row("ancillary", cost.ancillary, 0);
    row("total on the device", cost.device(), profile.budget_total);
    row("the file", result.file_bytes, 0);
    fmt::print("\n{:<26} {:>12} {:>12} {:>16}\n", "element", "bytes", "receivers", "energy dropped");
    for (const ElementCost& e : cost.elements) {
        float dropped = 0;
        for (const Contribution& c : pack.contributions)
            if (c.light_set == e.element && c.doors_open.empty() && c.doors_closed.empty()) dropped = c.energy_dropped;
        fmt::print("{:<26} {:>12} {:>12} {:>14.2f} %\n",
                   (pack.elements[e.element].kind == ElementKind::Door ? "door:" : "") + pack.elements[e.element].name,
                   humanBytes(e.bytes), e.receivers, 100 * static_cast<double>(dropped));
    }
    fmt::print("\npages: {} of {} x {} texels, {} clusters, {} batches, {} bounces, {:.1f} M rays, peak {}\n",
               pack.page_count, pack.page_width, pack.page_height, pack.clusters.size(), pack.batches.size(),
               result.stats.bounces, static_cast<double>(result.stats.rays) / 1e6, humanBytes(result.stats.peak_bytes));
}

nlohmann::ordered_json suggestions(const CookStats& stats) {
    auto list = nlohmann::ordered_json::array();
    for (const auto& [first, second] : stats.suggested_combinations) list.push_back({first, second});
    return list;
}

nlohmann::ordered_json toJson(const CookResult& result) {
    nlohmann::ordered_json json;
    json["seconds"] = result.stats.seconds;
    json["rays"] = result.stats.rays;
    const auto bake = result.stats.seconds.find("bake");
    json["rays_per_second"] = bake == result.stats.seconds.end() || bake->second <= 0
                                  ? 0
                                  : static_cast<double>(result.stats.rays) / bake->second;
    json["peak_bytes"] = result.stats.peak_bytes;
    json["file_bytes"] = result.file_bytes;
    json["warnings"] = result.stats.warnings;
    if (!result.stats.suggested_combinations.empty()) json["dimmer_combinations"] = suggestions(result.stats);
    return json;
}

int run(const Arguments& a) {
    const auto profile = loadProfile(a.options.profile);
    if (!profile) return reportError(profile.error());
    if (auto ok = checkWritable(a.options.pack); !ok) return reportError(ok.error());
    if (!a.json.empty() && a.json != "-")
        if (auto ok = checkWritable(a.json); !ok) return reportError(ok.error());
    if (!a.write_level.empty())
        if (auto ok = checkWritable(a.write_level); !ok) return reportError(ok.error());
    TerminalProgress progress;
    auto result = cook(a.options, progress);
    if (!result) return reportError(result.error());
    if (!a.write_level.empty())
        if (auto ok = writeLevel(a.options.level, result->pack, a.write_level, result->stats.warnings); !ok)
            return reportError(ok.error());
    for (const std::string& w : result->stats.warnings) fmt::print(stderr, "dimmer: warning: {}\n", w);
    if (!a.json.empty())
        if (auto ok = writeJson(toJson(*result), a.json); !ok) return reportError(ok.error());
    if (a.json != "-") printTable(*result, costOf(result->pack), *profile);
    if (a.json != "-" && a.suggest_combinations)
        fmt::print("\n\"dimmer_combinations\": {}\n", suggestions(result->stats).dump());
    return exit_done;
}

}  // namespace

void addCookCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<Arguments>();
    auto* c = app.add_subcommand("cook", "Bake a level and write its pack");
    c->add_option("LEVEL", a->options.level, "the level, .glb or .gltf (see docs/level.md)")->required();
    c->add_option("-o,--output", a->options.pack, "the pack to write, e.g. house.dimmer")->required();
    c->add_option("--profile", a->options.profile,
                  fmt::format("the target's budgets and densities: {}, or a JSON file that extends one",
                              fmt::join(shippedProfiles(), ", ")))
        ->capture_default_str();
    c->add_option("--quality", a->options.quality,
                  "draft (seconds to a minute), preview, or final (what ships): rays and samples per texel")
        ->check(CLI::IsMember({"draft", "preview", "final"}))
        ->capture_default_str();
    c->add_option("--threads", a->options.threads, "worker threads, 0 for all; the result does not depend on it")
        ->capture_default_str();
    c->add_flag(
        "--suggest-combinations", a->suggest_combinations,
        "print the pairs of doors that lose light which needs both (each a warning, too) for dimmer_combinations");
    c->add_flag("--per-set-passes", a->options.per_set_passes,
                "gather once per light set instead of sharing rays: the same pack, slower; for comparison");
    c->add_option("--grid-baseline", a->options.grid_baseline,
                  "the global grid as a baseline to measure it against: a uniform lattice of as many probes, probes "
                  "unfitted, or without tables of what they see (unseen)")
        ->check(CLI::IsMember({"uniform", "unfitted", "unseen"}));
    c->add_flag_callback(
        "--all-lights", [a] { a->options.light_grid = false; },
        "shadow rays to every light from everywhere, not to those alone that reach the surroundings; for comparison");
    c->add_option("--write-level", a->write_level,
                  "write the level there as .glb, its meshes with the final lightmap UVs in TEXCOORD_1");
    c->add_option(
        "--json", a->json,
        "write stage times (s), rays, peak memory (bytes) and warnings there; - for stdout, in the table's place");
    c->footer(
        "Progress and warnings go to stderr, the table of bytes per category and element to stdout. Over the "
        "profile's\n"
        "budget: exit code 3, nothing is written; Ctrl-C: 130, the old pack stays.\n"
        "Distances in levels are in metres, densities in texels per metre.\n"
        "Example: dimmer cook house.gltf -o house.dimmer --profile console --quality draft");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
