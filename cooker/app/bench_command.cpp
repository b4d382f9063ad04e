#include <app/bench.h>
#include <app/command.h>
#include <app/files.h>

#include <fmt/format.h>

#include <iostream>
#include <memory>

namespace dimmer::cook {

void addBenchCommand(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<BenchOptions>();
    auto* c = app.add_subcommand("bench", "What updates of a pack cost on this machine");
    c->add_option("PACK", options->pack, "a cooked pack")->required();
    c->add_option("--mode", options->mode, "worklist: the Vulkan runtime; the others: what it is compared with")
        ->check(CLI::IsMember({"worklist", "per-combination", "gather", "scatter", "cpu", "all"}))
        ->capture_default_str();
    c->add_option("--frames", options->frames, "updates measured per case")
        ->check(CLI::Range(1u, 1000000u))
        ->capture_default_str();
    c->add_option("--json", options->json, "write the figures as JSON; - for stdout, in the table's place");
    c->add_option("--only", options->only, "measure only cases whose names contain this");
    c->add_option("--plot", options->plot, "draw the figures as SVG");
    c->footer("Example: dimmer bench house.dimmer --frames 200 --json bench.json");
    c->callback([options, &exit_code] {
        options->command = fmt::format("dimmer bench {} --mode {} --frames {}", options->pack.string(), options->mode,
                                       options->frames);
        if (!options->only.empty()) options->command += fmt::format(" --only '{}'", options->only);
        auto done =
            checkFiles({{"PACK", options->pack}}, {printed("--json", options->json), {"--plot", options->plot}});
        if (done) done = benchPack(*options, std::cout);
        exit_code = done ? exit_done : reportError(done.error());
    });
}

}  // namespace dimmer::cook
