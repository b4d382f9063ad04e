#include <app/command.h>

#include <fmt/format.h>

#include <exception>

int main(int argc, char** argv) {
    using namespace dimmer::cook;
    CLI::App app{
        "Dimmer: baked global illumination that you can switch.\nCooks a glTF level into a pack, and looks into "
        "packs."};
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 done, 1 a fault of ours, 2 bad input or usage, 3 over budget.\n"
        "`dimmer COMMAND --help` explains a command and gives an example.");
    int exit_code = exit_done;
    addCookCommand(app, exit_code);
    addInspectCommand(app, exit_code);
    addSampleCommand(app, exit_code);
    addBenchCommand(app, exit_code);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? exit_done : exit_bad_input;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "dimmer: error: out of memory\n");
        return exit_our_fault;
    } catch (const std::exception& error) {
        fmt::print(stderr, "dimmer: internal error: {}\n", error.what());
        return exit_our_fault;
    }
    return exit_code;
}
