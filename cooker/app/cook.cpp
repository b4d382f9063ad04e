#include <app/command.h>
#include <app/cook_json.h>
#include <app/depfile.h>
#include <app/files.h>
#include <app/json_progress.h>
#include <app/say.h>
#include <app/terminal_progress.h>
#include <cpu/worker_pool.h>
#include <pipeline/budget.h>
#include <pipeline/cook.h>
#include <pipeline/human_bytes.h>
#include <pipeline/level_files.h>
#include <pipeline/write_level.h>
#include <report/report.h>
#include <write/pack_writer.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <span>

namespace dimmer::cook {
namespace {

constexpr uint32_t threads_max = WorkerPool::threads_max;  // millions are more than there is memory for

struct CookArguments {
    CookOptions options;
    std::string json, depfile;
    std::string write_level;
    std::string report;
    std::string progress = "text";
    bool no_cache = false, explain_cache = false;
    uint32_t cache_limit_mb = 4096;
    bool suggest_combinations = false;
};

// Beside the pack; nowhere where that is a device or a pipe.
std::filesystem::path defaultCache(const std::filesystem::path& pack) {
    std::error_code ignored;
    const auto status = std::filesystem::status(pack, ignored);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) return {};
    return pack.parent_path() / ".dimmer-cache";
}

std::filesystem::path cacheOf(const CookArguments& a) {
    if (a.no_cache) return {};
    return a.options.cache.empty() ? defaultCache(a.options.pack) : a.options.cache;
}

void printCache(const CookStats& stats) {
    fmt::print("\n{:<26} {}\n", "stage", "from the cache?");
    for (const CacheLine& line : stats.cache)
        fmt::print("{:<26} {}\n", line.what, line.reused ? "reused" : "made: " + line.why);
    if (stats.cache.empty()) fmt::print("no cache was used\n");
}

// Why there is no global grid; empty where there is one.
std::string gridNote(const CookResult& result) {
    if (!result.pack.probes.global.empty()) return {};
    const Profile& p = result.profile;
    if (p.global_grid == GridMode::Off) return "global grid: none, grids.global is off\n";
    if (p.probes_max == 0) return "global grid: none, grids.probes_max is 0\n";
    if (!result.grid_wanted) return "global grid: none, nothing in the level moves; --set grids.global=on makes one\n";
    return "global grid: none could be made; see the warnings\n";
}

void printTable(const CookResult& result, const PackCost& cost) {
    const PackData& pack = result.pack;
    fmt::print("{}", budgetTable(pack, cost, result.profile));
    fmt::print("\nfile: {}; pages: {} of {} x {} texels, {} clusters, {} batches, {} bounces, {:.1f} M rays, peak {}\n",
               humanBytes(result.file_bytes), pack.page_count, pack.page_width, pack.page_height, pack.clusters.size(),
               pack.batches.size(), result.stats.bounces, static_cast<double>(result.stats.rays) / 1e6,
               humanBytes(result.stats.peak_bytes));
    fmt::print("{}", gridNote(result));
    for (const Remedy& remedy : result.fitted) fmt::print("fitted: {}\n", remedy.text());
}

Expected<void> writeReport(const CookResult& result, const CookArguments& a) {
    const auto pack = Pack::fromData(PackData(result.pack));
    if (!pack) return std::unexpected(pack.error());
    ReportInput input;
    input.title = a.options.pack.filename().string();
    input.file_bytes = result.file_bytes;
    input.seconds = result.stats.seconds;
    input.bake_seconds = result.stats.bake_seconds;
    input.warnings = result.stats.warnings;
    return writeReport(*pack, input, a.report);
}

// What the cook is made from.
std::vector<NamedFile> inputsOf(const CookArguments& a) {
    std::vector<NamedFile> inputs = {{"LEVEL", a.options.level}};
    addFilesOf("LEVEL", filesNamedBy(a.options.level), inputs);
    const auto shipped = shippedProfiles();
    if (std::ranges::find(shipped, a.options.profile) == shipped.end())
        inputs.push_back({"--profile", a.options.profile});
    addFilesOf("--profile", filesExtendedBy(a.options.profile), inputs);
    return inputs;
}

std::vector<NamedFile> outputsOf(const CookArguments& a) {
    return {{"--output", a.options.pack},
            printed("--json", a.json),
            {"--depfile", a.depfile},
            {"--write-level", a.write_level},
            {"--report", a.report}};
}

// A cook does without a cache that cannot be written; but it is made, with what is above it, before the bake.
void addCache(const CookArguments& a, std::vector<NamedFile>& inputs) {
    const auto cache = cacheOf(a);
    inputs.push_back({"--cache", cache, true});
    std::error_code ignored;  // what cannot even be looked at is no output's trouble
    for (auto above = cache.parent_path(); !above.empty() && !std::filesystem::exists(above, ignored);
         above = above.parent_path())
        inputs.push_back({"--cache", above, true});
}

Expected<void> checkArguments(const CookArguments& a, const std::vector<NamedFile>& inputs) {
    if (auto ok = checkWritable(a.options.pack); !ok) return ok;  // even "" stands for a file here
    if (a.options.cache == "-") return fail(ErrorCode::InvalidArgument, "--cache: '-' is not a folder");
    std::vector<NamedFile> kept = inputs;
    addCache(a, kept);
    if (auto ok = checkFiles(kept, outputsOf(a)); !ok) return ok;
    if (!a.depfile.empty())
        if (auto ok = depfileText(a.options.pack, filesThere(inputs)); !ok) return std::unexpected(ok.error());
    if (std::filesystem::path(a.write_level).extension() == ".gltf")
        return fail(
            ErrorCode::InvalidArgument,
            fmt::format("--write-level: '{}' would be read as text, and binary glTF is written; end the name in "
                        ".glb",
                        a.write_level));
    return {};
}

// What is written beside the pack.
Expected<void> writeOthers(const CookArguments& a, const std::vector<std::filesystem::path>& inputs,
                           CookResult& result) {
    if (!a.depfile.empty()) {
        const auto text = depfileText(a.options.pack, inputs);
        if (!text) return std::unexpected(text.error());
        if (auto ok = writeFileAtomically(a.depfile, std::as_bytes(std::span(*text))); !ok) return ok;
    }
    if (!a.write_level.empty()) {
        std::vector<std::string>& warnings = result.stats.warnings;
        const size_t said = warnings.size();
        auto ok = writeLevel(a.options.level, result.pack, a.write_level, warnings);
        sayWarnings(std::span(warnings).subspan(said));
        if (!ok) return ok;
    }
    if (!a.report.empty())
        if (auto ok = writeReport(result, a); !ok) return ok;
    return a.json.empty() ? Expected<void>() : writeJson(cookJson(Verdict::Cooked, a.options, inputs, result), a.json);
}

// Whatever fails, what is there afterwards is of this cook. A file that is something else too is left to
// checkArguments().
Expected<void> removeOldJson(const CookArguments& a, std::vector<NamedFile> others) {
    addCache(a, others);
    for (const NamedFile& output : outputsOf(a))
        if (output.role != "--json") others.push_back(output);
    const bool its_own = checkFiles(others, {printed("--json", a.json)}).has_value();
    return its_own ? removeCookJson(a.json) : Expected<void>();
}

int reportFailure(const CookArguments& a, const std::vector<std::filesystem::path>& inputs, const Error& error,
                  const CookResult& failed) {
    const int exit_code = reportError(error);
    if (error.code != ErrorCode::OverBudget || a.json.empty()) return exit_code;
    const auto json = cookJson(Verdict::OverBudget, a.options, inputs, failed);
    if (auto ok = writeJson(json, a.json); !ok) reportError(ok.error());
    return exit_code;
}

int run(const CookArguments& a) {
    const std::vector<NamedFile> inputs = inputsOf(a);
    if (auto ok = removeOldJson(a, inputs); !ok) return reportError(ok.error());
    if (auto ok = checkArguments(a, inputs); !ok) return reportError(ok.error());
    std::unique_ptr<Progress> progress;
    if (a.progress == "json")
        progress = std::make_unique<JsonProgress>();
    else
        progress = std::make_unique<TerminalProgress>();
    CookOptions options = a.options;
    options.cache_bytes_max = uint64_t{a.cache_limit_mb} << 20;
    options.cache = cacheOf(a);
    CookResult failed;
    auto result = cook(options, *progress, &failed);
    progress->finish();  // of a stage that failed
    for (const std::string& warning : result ? result->stats.warnings : failed.stats.warnings) progress->warn(warning);
    const auto files = filesThere(inputs);
    if (!result) return reportFailure(a, files, result.error(), failed);
    if (auto ok = writeOthers(a, files, *result); !ok)
        return reportError({ok.error().code, fmt::format("{}\nThe pack has been written: {}", ok.error().message,
                                                         options.pack.string())});
    if (a.json != "-") printTable(*result, costOf(result->pack));
    if (a.json != "-" && a.explain_cache) printCache(result->stats);
    if (a.json != "-" && a.suggest_combinations)
        fmt::print("\n\"dimmer_combinations\": {}\n", suggestionsJson(result->stats).dump());
    return exit_done;
}

}  // namespace

void removeOldCookJson(const CLI::App& app) {
    const CLI::App* c = app.get_subcommand("cook");
    const auto read = [&](const char* option, auto& value) {
        if (c->count(option) > 0) value = c->get_option(option)->results().back();
    };
    CookArguments a;
    read("LEVEL", a.options.level);
    read("--output", a.options.pack);
    read("--profile", a.options.profile);
    read("--cache", a.options.cache);
    read("--json", a.json);
    read("--depfile", a.depfile);
    read("--write-level", a.write_level);
    read("--report", a.report);
    if (a.json.empty()) return;
    if (auto ok = removeOldJson(a, inputsOf(a)); !ok) reportError(ok.error());
}

void addCookCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<CookArguments>();
    auto* c = app.add_subcommand("cook", "Bake a level and write its pack");
    c->add_option("LEVEL", a->options.level, "the level, .glb or .gltf (see docs/level.md)")->required();
    c->add_option("-o,--output", a->options.pack, "the pack to write, e.g. house.dimmer")->required();
    c->add_option("--profile", a->options.profile,
                  fmt::format("the target's budgets and densities: {}, or a JSON file that extends one",
                              fmt::join(shippedProfiles(), ", ")))
        ->capture_default_str();
    auto* quality =
        c->add_option("--quality", a->options.quality,
                      "draft (seconds to a minute), preview, or final (what ships): rays and samples per texel")
            ->check(CLI::IsMember({"draft", "preview", "final"}))
            ->capture_default_str();
    c->add_option("--set", a->options.set,
                  "key=value: a setting of the profile (see profiles/schema.json), before what level and profile say")
        ->expected(1)
        ->take_all();
    c->add_option("--threads", a->options.threads, "worker threads, 0 for all; the result does not depend on it")
        ->check(CLI::Range(0u, threads_max))
        ->capture_default_str();
    c->add_flag(
        "--suggest-combinations", a->suggest_combinations,
        "print for dimmer_combinations the doors whose light depends on each other, or may (warnings tell of most)");
    auto* per_set_passes =
        c->add_flag("--per-set-passes", a->options.per_set_passes,
                    "gather once per light set instead of sharing rays: the same pack, slower; for comparison");
    auto* grid_baseline =
        c->add_option(
             "--grid-baseline", a->options.grid_baseline,
             "the global grid as a baseline to measure it against: a uniform lattice of as many probes, probes "
             "unfitted, or without tables of what they see (unseen)")
            ->check(CLI::IsMember({"uniform", "unfitted", "unseen"}));
    c->add_flag_callback(
        "--all-lights", [a] { a->options.light_grid = false; },
        "shadow rays to every light from everywhere, not to those alone that reach the surroundings; for comparison");
    c->add_option("--progress", a->progress,
                  "text, or json: lines with stage, done, total and seconds_left (of the stage) on stderr, among "
                  "messages, of which every line begins with \"dimmer: \"")
        ->check(CLI::IsMember({"text", "json"}))
        ->capture_default_str();
    c->add_option("--report", a->report,
                  "write an HTML page there: pages, regions of sets and doors, overlaps, budgets, times, warnings");
    c->add_option("--write-level", a->write_level,
                  "write the level there as .glb, its meshes with the final lightmap UVs in TEXCOORD_1");
    auto* cache = c->add_option("--cache", a->options.cache,
                                "folder of what earlier cooks found out; default: .dimmer-cache beside the pack");
    auto* no_cache =
        c->add_flag("--no-cache", a->no_cache, "keep nothing and reuse nothing; the pack is the same")->excludes(cache);
    auto* limit = c->add_option("--cache-limit", a->cache_limit_mb,
                                "MiB that the cache may hold; what was used least recently goes first")
                      ->capture_default_str()
                      ->excludes(no_cache);
    // What is measured against is made anew.
    for (CLI::Option* baseline : {per_set_passes, grid_baseline}) baseline->excludes(cache)->excludes(limit);
    auto* fit =
        c->add_flag("--fit", a->options.fit,
                    "over budget: raise the thresholds of the sets that lose least, lower the density or take fewer "
                    "probes, until it fits; "
                    "the table says what was changed and the mean error that it adds");
    c->add_option(
         "--fit-max-error", a->options.fit_error_max,
         "exit with 3 instead where --fit would add a larger mean error as predicted, at surfaces or to the light of "
         "models, e.g. 0.05 for 5 %")
        ->needs(fit)
        ->check(refuseNoShare);
    c->add_flag("--explain-cache", a->explain_cache, "say what was reused, and why the rest was not")
        ->excludes(no_cache)
        ->excludes(per_set_passes)
        ->excludes(grid_baseline);
    c->add_option(
        "--json", a->json,
        "write the result (cooked or over_budget), bytes against budgets, stage times (s), rays, peak memory (bytes), "
        "warnings, what --fit changed and, over budget, all remedies there; - for stdout, in the table's place");
    c->add_option(
        "--depfile", a->depfile,
        "write there what the pack is made from, in Make's syntax: level, buffers, images, light profiles, sky, "
        "profiles; names that Make or Ninja would misread are refused");
    c->footer(
        "Progress and warnings go to stderr, the table of bytes per category and element to stdout. Over the "
        "profile's\n"
        "budget: exit code 3, nothing is written but --json; Ctrl-C: 130, the old pack stays. What an earlier cook\n"
        "wrote to --json is removed first, so that it never passes for this one's.\n"
        "Distances in levels are in metres, densities in texels per metre.\n"
        "Example: dimmer cook house.gltf -o house.dimmer --profile console --quality draft");
    c->callback([a, quality, &exit_code] {
        a->options.quality_is_chosen = quality->count() > 0;
        exit_code = run(*a);
    });
}

}  // namespace dimmer::cook
