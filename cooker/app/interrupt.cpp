#include <app/interrupt.h>
#include <app/say.h>
#include <write/pack_writer.h>

#include <unistd.h>

#include <csignal>
#include <thread>

namespace dimmer::cook {

void endCleanlyOnInterrupt() {
    sigset_t signals;
    sigemptyset(&signals);
    bool any = false;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction action {};
        if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler == SIG_IGN) continue;
        sigaddset(&signals, signal);
        any = true;
    }
    if (!any || pthread_sigmask(SIG_BLOCK, &signals, nullptr) != 0) return;
    // A thread may do what a signal handler must not: wait for a lock, and print.
    std::thread([signals] {
        int signal = 0;
        if (sigwait(&signals, &signal) != 0) return;
        fileReplacement().lock();
        // A terminal's cursor stands behind the progress bar.
        if (isatty(STDERR_FILENO) == 1) say("\r\x1b[K");
        sayMessage("interrupted");
        _exit(128 + signal);
    }).detach();
}

}  // namespace dimmer::cook
