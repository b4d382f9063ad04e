#include <app/command.h>
#include <app/files.h>
#include <synth/synth.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

namespace dimmer::cook {
namespace {

struct SynthArguments {
    std::string like, output, color = "e5b9g9r9";
    SynthOptions options;
};

std::vector<std::string> levelNames() {
    std::vector<std::string> names;
    for (const LevelStatistics& level : productionLevels()) names.emplace_back(level.name);
    return names;
}

int run(SynthArguments& a) {
    if (auto ok = checkFiles({}, {{"--output", a.output}}); !ok) return reportError(ok.error());
    a.options.level = *productionLevel(a.like);
    a.options.color_format = a.color == "e5b9g9r9" ? ColorFormat::E5B9G9R9 : ColorFormat::R11G11B10F;
    auto data = synthesise(a.options);
    if (!data) return reportError(data.error());
    const auto bytes = packBytes(*data);
    if (auto ok = writeFileAtomically(a.output, bytes); !ok) return reportError(ok.error());
    const auto sets = data->elements.size() - a.options.level.doors;
    const auto lighting =
        std::count_if(data->contributions.begin(), data->contributions.begin() + static_cast<std::ptrdiff_t>(sets),
                      [](const Contribution& c) { return c.receivers > 0; });
    fmt::print(
        "{}: {} texels, {} of them in {} clusters, {} records ({:.3f} per texel), {} light sets ({} of them light "
        "something), {} doors\n",
        a.output, data->base_pages.size(), data->addresses.size(), data->clusters.size(), data->payload.size(),
        static_cast<double>(data->payload.size()) / static_cast<double>(data->base_pages.size()), sets, lighting,
        a.options.level.doors);
    return exit_done;
}

}  // namespace

void addSynthCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<SynthArguments>();
    auto* c = app.add_subcommand("synth", "A pack with the statistics of a production level and random records");
    c->add_option("--like", a->like, "the level, of Table 1 of UBERBAKE")
        ->required()
        ->check(CLI::IsMember(levelNames()));
    c->add_option("-o,--output", a->output, "where to write the pack")->required();
    c->add_option("--scale", a->options.scale, "times the level's texels")->capture_default_str();
    c->add_option("--clusters", a->options.clusters, "distinct lists of contributions")->capture_default_str();
    c->add_option("--sets", a->options.light_sets, "light sets; 0: as many as the level")->capture_default_str();
    c->add_option("--color", a->color, "how light is stored")
        ->check(CLI::IsMember({"e5b9g9r9", "r11g11b10f"}))
        ->capture_default_str();
    c->add_flag("--probes", a->options.probes, "light probes as well, as many as the level has");
    c->add_option("--seed", a->options.seed, "of the random numbers")->capture_default_str();
    c->footer("Example: dimmer synth --like estate --clusters 1000 -o estate.dimmer");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
