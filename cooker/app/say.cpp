#include <app/say.h>

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

namespace dimmer::cook {

void say(std::string_view text) noexcept {
    std::fwrite(text.data(), 1, text.size(), stderr);
    std::fflush(stderr);
}

void sayMessage(std::string_view message) noexcept {
    flockfile(stderr);  // no other thread's line between those of a message
    for (bool more = true; more;) {
        const size_t end = message.find('\n');
        say("dimmer: ");
        say(message.substr(0, end));
        say("\n");
        more = end != std::string_view::npos;
        if (more) message.remove_prefix(end + 1);
    }
    funlockfile(stderr);
}

void sayWarning(std::string_view warning) {
    sayMessage("warning: " + std::string(warning));
}

void sayWarnings(std::span<const std::string> warnings) {
    for (const std::string& warning : warnings) sayWarning(warning);
}

void keepClosedStreamsClosed() noexcept {
    // open() takes the lowest free number. Each stream gets the direction that it is not used in.
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
            if (open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
}

}  // namespace dimmer::cook
