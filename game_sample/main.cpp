// dimmer-sample: a small game. Arguments in, exit code out; the work is in window_player.cpp and player.cpp.
#include "balls.h"
#include "output_files.h"
#include "player.h"
#include "window_player.h"

#include <dimmer/version.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>

namespace {

using namespace dimmer;
using namespace dimmer::sample;

constexpr int exit_done = 0, exit_fault = 1, exit_bad_input = 2;

struct Arguments {
    std::string pack, script, out = "out/sample", size, camera, picture;
    uint32_t frames = 0;
    bool headless = false, validate = false, no_self_visibility = false;
};

void declare(CLI::App& app, Arguments& arguments) {
    app.add_option("pack", arguments.pack, "The cooked level (*.dimmer)")->required();
    app.add_option("--script", arguments.script,
                   "What to play: a text file, see demo.script (default: nothing, every light set at 1)");
    app.add_flag("--headless", arguments.headless,
                 "Play into pictures, frame_0000.png ... and cost.json in --out, instead of a window; those of an "
                 "earlier run go");
    app.add_option("--out", arguments.out, "Folder for pictures (a window's: those taken by F12); made when missing")
        ->capture_default_str();
    app.add_option("--frames", arguments.frames,
                   "Number of frames (default: the script's; in a window: until it is closed)")
        ->check(CLI::Range(1u, frame_count_max));
    app.add_option(
        "--picture", arguments.picture,
        "Of a window with --frames (from 2 on: panels need one to be laid out): what it shows at the end, as PNG");
    app.add_option("--size", arguments.size, "Picture size in pixels, WxH (default: the script's, else 960x540)");
    app.add_option("--camera", arguments.camera,
                   "Name of the camera to begin with (default: the script's, else the level's first)");
    app.add_flag("--validate", arguments.validate, "Run under the Vulkan validation layers; exit 1 if they complain");
    app.add_flag("--no-self-visibility", arguments.no_self_visibility,
                 "Light models by their light grids alone, without their shadows on themselves");
    app.set_version_flag("--version", "dimmer-sample " DIMMER_VERSION);
    app.footer(
        "Without --headless a window opens: W A S D Q E fly, the right mouse button looks, Shift hurries; a panel has\n"
        "every light set and door, what each change costs, and limits; F1 hides it, F12 takes a picture, Esc quits.\n"
        "It draws what a pack has: all doors slide aside, also those whose light was baked for another open pose, no\n"
        "texture cuts holes into a mesh, and the sky is black but for what a script says.\n"
        "Examples: dimmer-sample house.dimmer\n"
        "          dimmer-sample house.dimmer --script demo.script --headless --out out/frames\n"
        "Exit codes: 0 done, 1 a fault of ours, 2 bad input or usage, 130 or 143 interrupted.");
}

// Where a standard stream is closed or its reader goes away, what is said is lost and the pictures are made: no file
// of ours gets a stream's number, and no signal ends the work.
void keepWorkingUnheard() {
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);  // so that a write past a limit fails, and its file goes
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
            if (open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
}

// To stderr; lost where that is closed or full (fmt::print() would throw).
void say(const std::string& message) {
    std::fputs((message + "\n").c_str(), stderr);
}

int report(const Error& error) {
    say("dimmer-sample: " + error.message);
    switch (error.code) {
        case ErrorCode::InvalidArgument:
        case ErrorCode::NotFound:
        case ErrorCode::BadInput:
        case ErrorCode::Io:
            return exit_bad_input;
        default:
            return exit_fault;
    }
}

Expected<std::string> readText(const std::string& path) {
    std::error_code ignored;
    // A folder can be opened, and throws when it is read.
    std::ifstream file(std::filesystem::is_directory(path, ignored) ? std::string() : path, std::ios::binary);
    const std::string text(std::istreambuf_iterator<char>(file), {});
    if (!file.is_open() || file.bad()) return fail(ErrorCode::Io, fmt::format("{}: cannot be read.", path));
    return text;
}

Expected<void> applySize(const std::string& size, Script& script) {
    uint32_t width = 0, height = 0;
    char x = 0, rest = 0;
    std::istringstream in(size);
    const auto valid = [](uint32_t side) { return side >= 1 && side <= image_side_max; };
    if (!(in >> width >> x >> height) || x != 'x' || in >> rest || !valid(width) || !valid(height))
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("--size {}: not WxH with sides of 1..{} pixels; an example: "
                                "960x540.",
                                size, image_side_max));
    script.width = width;
    script.height = height;
    return {};
}

// The script with what the command line overrides.
Expected<Script> prepareScript(const Arguments& arguments, const Pack& pack) {
    std::string text;
    if (arguments.script.empty()) {
        text = "frames 1";
    } else {
        auto read = readText(arguments.script);
        if (!read) return std::unexpected(read.error());
        text = std::move(*read);
    }
    auto script = parseScript(text, arguments.script, pack);
    if (!script) return script;
    std::ranges::copy(ballsAtPlaces(pack), std::back_inserter(script->balls));
    for (const std::string& warning : script->warnings) say("dimmer-sample: warning: " + warning);
    if (arguments.frames) script->frames = arguments.frames;
    if (!arguments.size.empty())
        if (auto done = applySize(arguments.size, *script); !done) return std::unexpected(done.error());
    if (!arguments.camera.empty()) {
        const auto camera = findCamera(pack, arguments.camera);
        if (!camera) return std::unexpected(camera.error());
        script->camera = *camera;
    }
    return script;
}

int finish(const std::vector<std::string>& validation_messages, int exit_code) {
    for (const std::string& message : validation_messages) say("validation: " + message);
    return validation_messages.empty() ? exit_code : exit_fault;
}

int runInWindow(const Arguments& arguments, const Pack& pack, const Script& script) {
    const auto messages = playInWindow(pack, script,
                                       {.pack = arguments.pack,
                                        .out = arguments.out,
                                        .has_script = !arguments.script.empty(),
                                        .frames = arguments.frames,
                                        .picture = arguments.picture,
                                        .validate = arguments.validate,
                                        .self_visibility = !arguments.no_self_visibility});
    return messages ? finish(*messages, exit_done) : report(messages.error());
}

int runHeadless(const Arguments& arguments, const Pack& pack, const Script& script) {
    const auto played = playHeadless(pack, script,
                                     {.pack = arguments.pack,
                                      .script = arguments.script,
                                      .out = arguments.out,
                                      .validate = arguments.validate,
                                      .self_visibility = !arguments.no_self_visibility});
    if (!played) return report(played.error());
    const std::string table = played->cost.table(played->device, played->driver);
    const bool printed = std::fputs(table.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
    return finish(played->validation_messages,
                  printed ? exit_done : report({ErrorCode::Io, "the output could not be written"}));
}

int run(const Arguments& arguments) {
    if (!arguments.picture.empty() && (arguments.headless || arguments.frames == 0))
        return report({ErrorCode::InvalidArgument, "--picture is of a window with --frames; not with --headless"});
    const auto pack = Pack::open(arguments.pack);
    if (!pack) return report(pack.error());
    const auto script = prepareScript(arguments, *pack);
    if (!script) return report(script.error());
    if (const auto ok = checkPicture(arguments.picture, {arguments.pack, arguments.script}); !ok)
        return report(ok.error());
    return arguments.headless ? runHeadless(arguments, *pack, *script) : runInWindow(arguments, *pack, *script);
}

}  // namespace

int main(int argc, char** argv) {
    keepWorkingUnheard();
    CLI::App app(
        "A small game on a cooked level: switch its lights by hand in a window, or play a script of switches into "
        "pictures.");
    Arguments arguments;
    declare(app, arguments);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? exit_done : exit_bad_input;
    }
    return run(arguments);
}
