// The sample in a window: a person flies through a level and switches its lights, beside a script or alone.
#pragma once

#include "script.h"

#include <filesystem>

namespace dimmer::sample {

struct WindowOptions {
    std::filesystem::path pack;
    std::filesystem::path out;  // folder for pictures that the person takes; made when one is
    bool has_script = false;    // else the person alone
    uint32_t frames = 0;        // shown before it closes by itself, each a frame of the script; 0: until it is closed
    std::filesystem::path picture;  // of what the window shows in the last frame; empty: none
    bool validate = false;
    bool self_visibility = true;
};

// Returns the validation layer's messages, empty unless asked for.
Expected<std::vector<std::string>> playInWindow(const Pack& pack, const Script& script, const WindowOptions& options);

}  // namespace dimmer::sample
