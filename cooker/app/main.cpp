#include <app/command.h>
#include <app/interrupt.h>
#include <app/say.h>
#include <dimmer/version.h>
#include <update/state_text.h>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>

namespace {

using dimmer::cook::sayMessage;

// Of the pipe that stdout is, as `head` goes when it has enough.
bool readerHasGone() {
    pollfd out{.fd = STDOUT_FILENO, .events = 0, .revents = 0};
    return poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0;
}

// Output that a full disk or a closed pipe swallowed is no output: the caller must not take it for done. A reader that
// has gone does not want to be told.
int checkOutput(int exit_code) {
    using namespace dimmer::cook;
    const bool written = std::cout.flush() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
    if (written || exit_code != exit_done) return exit_code;
    if (!readerHasGone()) sayMessage("error: the output could not be written");
    return exit_bad_input;
}

// A first word that is no command gets a better answer than CLI11's.
bool isCommand(const CLI::App& app, int argc, char** argv) {
    if (argc < 2) {
        sayMessage("error: a command is missing; `dimmer --help` lists them");
        return false;
    }
    const std::string_view word = argv[1];
    std::vector<std::string> commands;
    for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command->get_name());
    if (word.starts_with('-') || std::ranges::find(commands, word) != commands.end()) return true;
    const std::string_view nearest = dimmer::nearestName(word, {commands.begin(), commands.end()});
    sayMessage(
        fmt::format("error: there is no command '{}'; {}", word,
                    nearest.empty() ? "`dimmer --help` lists them" : fmt::format("did you mean '{}'?", nearest)));
    return false;
}

// Help is asked for by what CLI11 throws, too.
int endOfParsing(const CLI::App& app, const CLI::ParseError& error) {
    using namespace dimmer::cook;
    if (error.get_exit_code() == 0) return checkOutput(app.exit(error));
    sayMessage(fmt::format("error: {}\n`dimmer COMMAND --help` explains a command", error.what()));
    removeOldCookJson(app);
    return exit_bad_input;
}

}  // namespace

int main(int argc, char** argv) {
    using namespace dimmer::cook;
    keepClosedStreamsClosed();
    std::signal(SIGPIPE, SIG_IGN);  // writing shows what is lost; of stderr that is no reason to end the work
    std::signal(SIGXFSZ, SIG_IGN);  // so that a write past a limit fails, and its file goes
    CLI::App app{
        "Dimmer: baked global illumination that you can switch.\nCooks a glTF level into a pack, and looks into "
        "packs."};
    app.require_subcommand(1);
    app.set_version_flag("--version", "dimmer " DIMMER_VERSION);
    app.footer(
        "Exit codes: 0 done, 1 a fault of ours, 2 bad input or usage, 3 over budget, "
        "4 error above --max-error, 130 interrupted (SIGTERM 143, SIGHUP 129).\n"
        "No command writes over a file that it reads; what it is to write is looked at before the work.\n"
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
        return endOfParsing(app, error);
    } catch (const std::bad_alloc&) {
        sayMessage("error: out of memory");
        return exit_our_fault;
    } catch (const std::exception& error) {
        if (std::ferror(stdout)) return checkOutput(exit_done);  // fmt throws about the stream that it prints to
        sayMessage(fmt::format("internal error: {}", error.what()));
        return exit_our_fault;
    }
    return checkOutput(exit_code);
}
