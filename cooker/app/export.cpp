#include <app/command.h>
#include <app/files.h>
#include <app/terminal_progress.h>
#include <pipeline/export_pack.h>
#include <pipeline/human_bytes.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

#include <memory>

namespace dimmer::cook {
namespace {

struct ExportArguments {
    std::string pack;
    std::filesystem::path folder;
};

int run(const ExportArguments& a) {
    const std::filesystem::path pack_name = behindLinks(a.pack).value_or(a.pack).filename();
    std::vector<NamedFile> outputs = {{"DIR", a.folder, true}};
    std::error_code ignored;
    if (isExportedName(pack_name.string()) && std::filesystem::exists(a.folder / pack_name, ignored))
        outputs.push_back({"a file of DIR", a.folder / pack_name});
    if (auto ok = checkFiles({{"PACK", a.pack}}, outputs); !ok) return reportError(ok.error());
    const auto pack = Pack::open(a.pack);
    if (!pack) return reportError(pack.error());
    TerminalProgress progress;
    const auto stats = exportPack(*pack, a.folder, progress);
    if (!stats) return reportError(stats.error());
    fmt::print("{}: {} files, {}\n", a.folder.string(), stats->files, humanBytes(stats->bytes));
    return exit_done;
}

}  // namespace

void addExportCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<ExportArguments>();
    auto* c = app.add_subcommand("export", "Pages and contributions as OpenEXR, for engines that blend on their own");
    c->add_option("PACK", a->pack, "a cooked pack")->required();
    c->add_option("DIR", a->folder, "the folder to write into, created when missing")->required();
    c->footer(
        "Pictures hold lux at weight 1 (R, G, B) and direction (direction.r, .x, .y), cropped to the texels that a\n"
        "contribution touches; index.json names them, and is written last. An earlier export in the folder goes "
        "first.\n"
        "docs/format.md says how to blend them.\n"
        "Example: dimmer export house.dimmer house_light");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
