#include <app/command.h>
#include <app/interrupt.h>
#include <update/state_text.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>

namespace {

// Output that a full disk or a closed pipe swallowed is no output: the caller must not take it for done.
int checkOutput(int exit_code) {
    using namespace dimmer::cook;
    const bool written = std::cout.flush() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
    if (written || exit_code != exit_done) return exit_code;
    fmt::print(stderr, "dimmer: error: the output could not be written\n");
    return exit_bad_input;
}

// A first word that is no command gets a better answer than CLI11's.
bool isCommand(const CLI::App& app, int argc, char** argv) {
    if (argc < 2) {
        fmt::print(stderr, "dimmer: error: a command is missing; `dimmer --help` lists them\n");
        return false;
    }
    const std::string_view word = argv[1];
    std::vector<std::string> commands;
    for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command->get_name());
    if (word.starts_with('-') || std::ranges::find(commands, word) != commands.end()) return true;
    const std::string_view nearest = dimmer::nearestName(word, {commands.begin(), commands.end()});
    fmt::print(stderr, "dimmer: error: there is no command '{}'; {}\n", word,
               nearest.empty() ? "`dimmer --help` lists them" : fmt::format("did you mean '{}'?", nearest));
    return false;
}

}  // namespace

int main(int argc, char** argv) {
    using namespace dimmer::cook;
    CLI::App app{
        "Dimmer: baked global illumination that you can switch.\nCooks a glTF level into a pack, and looks into "
        "packs."};
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 done, 1 a fault of ours, 2 bad input or usage, 3 over budget, "
        "4 error above --max-error, 130 interrupted.\n"
        "`dimmer COMMAND --help` explains a command and gives an example.");
    int exit_code = exit_done;
    addCookCommand(app, exit_code);
    addInspectCommand(app, exit_code);
    addSampleCommand(app, exit_code);
    addBenchCommand(app, exit_code);
    addSynthCommand(app, exit_code);
    addVerifyCommand(app, exit_code);
    addReferenceCommand(app, exit_code);
    addExplainCommand(app, exit_code);
    addExportCommand(app, exit_code);
    addReportCommand(app, exit_code);
    addStressCommand(app, exit_code);
    if (!isCommand(app, argc, argv)) return exit_bad_input;
    try {
        endCleanlyOnInterrupt();
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? exit_done : exit_bad_input;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "dimmer: error: out of memory\n");
        return exit_our_fault;
    } catch (const std::exception& error) {
        if (std::ferror(stdout)) return checkOutput(exit_done);  // fmt throws about the stream that it prints to
        fmt::print(stderr, "dimmer: internal error: {}\n", error.what());
        return exit_our_fault;
    }
    return checkOutput(exit_code);
}
