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

// What the panels show, and what a person sets by them.
struct Panels {
    CostHistory costs;
    std::string device, level;
    std::string message;  // the last one
    bool has_script = false, script_runs = false;
    UpdateLimits limits;
    float faster = 1;  // of the camera
};

// What a person asks for in one frame.
struct PanelRequests {
    std::optional<CameraPose> look_from;
    bool restart = false;
};

// Within a frame of Dear ImGui.
PanelRequests drawPanels(Panels& panels, Controls& controls, Runtime& lights);

}  // namespace dimmer::sample
