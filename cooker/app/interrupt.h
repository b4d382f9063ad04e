// Ctrl-C, what `kill` and build systems send, and a terminal that is closed.
#pragma once

namespace dimmer::cook {

// From here on SIGINT, SIGTERM and SIGHUP end the process at once with a message and the exit code that shells give
// them, 130, 143 and 129, but never in the middle of replacing a file: no temporary file stays behind, and files are as
// they were or complete. A signal that the caller had ignored stays ignored. To be called before any other thread
// starts: they inherit that the signals wait.
void endCleanlyOnInterrupt();

}  // namespace dimmer::cook
