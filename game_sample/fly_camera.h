// A camera that a person flies: keys move it, the mouse turns it.
#pragma once

#include "camera.h"

namespace dimmer::sample {

// What the person asks for, as of one frame.
struct FlyInput {
    glm::vec3 move{0};      // to the right, up, forward: -1..1 each
    glm::vec2 turn_rad{0};  // to the right, up
    float faster = 1;       // times the usual speed
};

// Moves along where the camera looks, at walking pace, and up along the world's +Y; never looks quite straight up or
// down.
CameraPose fly(const CameraPose& from, const FlyInput& input, float seconds);

}  // namespace dimmer::sample
