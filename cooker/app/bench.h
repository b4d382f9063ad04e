// `dimmer bench`: what updates of a pack cost on this machine.
#pragma once

#include <dimmer/error.h>

#include <filesystem>
#include <iosfwd>
#include <string>

namespace dimmer::cook {

struct BenchOptions {
    std::filesystem::path pack{};
    uint32_t frames = 100;          // updates measured per case, 1 or more
    std::string mode = "worklist";  // "worklist" (Vulkan), "cpu" or "all"
    // Where to write the figures as JSON; empty: nowhere; "-": to `out`, in the table's place.
    std::filesystem::path json{};
    std::string command{};  // the command line, quoted in the output
};

// Measures: nothing changed; each light set and each door toggled alone; all light sets changed. Prints a table to
// `out`. Times are medians with their least and greatest, in microseconds: on the GPU's clock, and on the host for
// planning and recording.
Expected<void> benchPack(const BenchOptions& options, std::ostream& out);

}  // namespace dimmer::cook
