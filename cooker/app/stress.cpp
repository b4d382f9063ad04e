#include <app/command.h>
#include <app/files.h>
#include <app/say.h>
#include <app/terminal_progress.h>
#include <pipeline/human_bytes.h>
#include <stress/stress.h>

#include <fmt/format.h>

#include <memory>
#include <optional>

namespace dimmer::cook {
namespace {

struct StressArguments {
    std::string pack, json;
    StressOptions options;
    double minutes = 10;
    bool cpu_only = false;
};

void printReport(const StressReport& r, const std::string& device) {
    fmt::print("{} frames, {} changes, {} checks in {:.0f} s; {}\n\n", r.frames, r.events, r.checks, r.seconds, device);
    fmt::print("{:<28}{:>16}{:>12}{:>14}\n", "runtime", "words compared", "different", "not a number");
    for (const StressTally& t : r.executors)
        fmt::print("{:<28}{:>16}{:>12}{:>14}\n", t.name, t.words, t.words_different, t.not_numbers);
    fmt::print("\nmemory after a tenth of the run {}, at most {}, at the end {}; on devices {}, then {}{}\n",
               humanBytes(r.resident_start_bytes), humanBytes(r.resident_most_bytes), humanBytes(r.resident_end_bytes),
               humanBytes(r.device_start_bytes), humanBytes(r.device_end_bytes),
               r.memoryJudged() ? "" : " (not judged: fewer than 100 checks)");
}

nlohmann::ordered_json toJson(const StressReport& r, const StressArguments& a, const std::string& device) {
    nlohmann::ordered_json j = {{"pack", a.pack},       {"seed", a.options.seed}, {"device", device},
                                {"frames", r.frames},   {"events", r.events},     {"checks", r.checks},
                                {"seconds", r.seconds}, {"exact", r.exact()}};
    j["memory_flat"] = r.memoryJudged() ? nlohmann::ordered_json(r.memoryFlat()) : nullptr;  // null: not judged
    for (const StressTally& t : r.executors)
        j["runtimes"].push_back(
            {{"name", t.name}, {"words", t.words}, {"different", t.words_different}, {"not_numbers", t.not_numbers}});
    j["resident_bytes"] = {
        {"start", r.resident_start_bytes}, {"most", r.resident_most_bytes}, {"end", r.resident_end_bytes}};
    j["device_bytes"] = {{"start", r.device_start_bytes}, {"end", r.device_end_bytes}};
    return j;
}

int run(StressArguments a) {
    if (auto ok = checkFiles({{"PACK", a.pack}}, {printed("--json", a.json)}); !ok) return reportError(ok.error());
    const auto pack = Pack::open(a.pack);
    if (!pack) return reportError(pack.error());
    a.options.seconds_max = a.minutes * 60;
    std::optional<HeadlessDevice> device;
    if (!a.cpu_only) {
        auto made = HeadlessDevice::create();
        if (!made) return reportError(made.error());
        device = std::move(*made);
    }
    const std::string name = device ? fmt::format("{}, {}", device->name(), device->driver()) : "CPU runtimes alone";
    TerminalProgress progress;
    const auto report = stress(*pack, device ? &*device : nullptr, a.options, progress);
    if (!report) return reportError(report.error());
    if (!a.json.empty())
        if (auto ok = writeJson(toJson(*report, a, name), a.json); !ok) return reportError(ok.error());
    if (a.json != "-") printReport(*report, name);
    if (report->exact() && report->memoryFlat()) return exit_done;
    sayMessage(
        fmt::format("{}; please report it with the pack and seed {}",
                    report->exact() ? "memory grew or shrank by more than 1 %" : "pages differ from a fresh blend",
                    a.options.seed));
    return exit_our_fault;
}

}  // namespace

void addStressCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<StressArguments>();
    auto* c = app.add_subcommand("stress", "Play a random game on every runtime; pages must never drift");
    c->add_option("PACK", a->pack, "a cooked pack")->required();
    c->add_option("--frames", a->options.frames, "frames at most, the one before each comparison among them")
        ->check(CLI::Range(uint64_t{1}, uint64_t{1} << 40))
        ->capture_default_str();
    c->add_option("--minutes", a->minutes, "end after so long; 0: after all frames")
        ->check(CLI::Range(0.0, 1e6))
        ->check(refuseNotFinite)
        ->capture_default_str();
    c->add_option("--check-every", a->options.check_every, "frames between two comparisons with a fresh blend")
        ->check(CLI::Range(1u, 1u << 30))
        ->capture_default_str();
    c->add_option("--seed", a->options.seed, "of the game")->capture_default_str();
    c->add_flag("--cpu", a->cpu_only, "without Vulkan");
    c->add_option("--json", a->json, "write the report there; - for stdout");
    c->footer(
        "Weights, colours, doors, budgets, movers, dropping and loading of records, in both bufferings. Exit code 1 "
        "when a word differs, a number is none, or memory is not flat.\n"
        "Example: dimmer stress house.dimmer --minutes 2 --seed 7 --json stress.json");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
