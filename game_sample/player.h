// The sample without a window: plays a script on a pack, frame by frame, into pictures and a table of costs.
#pragma once

#include "cost_report.h"
#include "script.h"

#include <filesystem>

namespace dimmer::sample {

struct PlayOptions {
    std::filesystem::path pack, script;  // never written over
    std::filesystem::path out;           // folder for frame_0000.png ... and cost.json (output_files.h)
    bool validate = false;               // load the Vulkan validation layers
    bool self_visibility = true;         // models' shadows on themselves
};

struct PlayResult {
    CostReport cost;
    std::string device, driver;
    std::vector<std::string> validation_messages;  // empty unless asked for
};

// Progress goes to stderr.
Expected<PlayResult> playHeadless(const Pack& pack, const Script& script, const PlayOptions& options);

}  // namespace dimmer::sample
