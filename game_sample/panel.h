// The sample's panels: every light set and door by hand, and what the last change cost.
#pragma once

#include "camera.h"
#include "controls.h"

#include <dimmer/runtime.h>

#include <array>
#include <optional>
#include <string>

namespace dimmer::sample {

// What changes made updates cost, newest last.
class CostHistory {
   public:
    // Of each frame's update, with or without work.
    void add(const UpdateStats& stats);

    std::optional<UpdateStats> last_change;  // the last update that wrote texels or probes of the level
    uint64_t moving_probes = 0;              // taken anew in the last update, for things that move
    std::array<float, 240> host_us{}, gpu_us{};
};

// What the panels show, and what a person asks for by them.
struct Panels {
    CostHistory costs;
    std::string device, level;
    bool has_script = false, script_runs = false;
    UpdateLimits limits;
    float faster = 1;  // of the camera

    std::optional<CameraPose> look_from;  // asked for in this frame
    bool restart = false;                 // likewise
};

// Within a frame of Dear ImGui.
Expected<void> drawPanels(Panels& panels, Controls& controls, Runtime& lights);

}  // namespace dimmer::sample
