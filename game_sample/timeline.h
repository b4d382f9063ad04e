// Plays a script: what it does to the lights and the camera, frame by frame.
#pragma once

#include "script.h"

#include <string>
#include <vector>

namespace dimmer::sample {

class Timeline {
   public:
    // `script` must outlive the timeline.
    explicit Timeline(const Script& script) : script_(script), camera_(script.camera) {}

    // Call once for each frame, in ascending order from 0. Returns the texts of the steps that touched lights.
    Expected<std::vector<std::string>> advance(uint32_t frame, LightState& lights);

    const CameraPose& camera() const { return camera_; }
    // The frame shows another place than the one before.
    bool cut() const { return cut_; }

   private:
    // A step that lasts.
    struct Running {
        const Step* step;
        Weight start_weight;    // flicker
        CameraPose start_view;  // move
    };

    Expected<void> begin(const Step& step, LightState& lights);
    Expected<bool> run(const Running& running, uint32_t frame, LightState& lights);

    const Script& script_;
    size_t next_step_ = 0;
    std::vector<Running> running_;
    CameraPose camera_;
    bool cut_ = false;
};

// In [0, 1): the flicker's noise, a function of the seed and the frame alone.
float flickerNoise(uint32_t seed, uint32_t frame);

}  // namespace dimmer::sample
