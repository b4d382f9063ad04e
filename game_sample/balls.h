// The balls of a script: models that the runtime lights, and the spheres to draw.
#pragma once

#include "script.h"
#include "sphere_renderer.h"

#include <vector>

namespace dimmer::sample {

// Room that the runtime needs for them.
uint32_t movingProbes(const Script& script);

class Balls {
   public:
    // `script` must outlive the balls. OutOfMemory where `lights` was made without room for movingProbes().
    static Expected<Balls> create(const Script& script, LightState& lights);

    // To where they are in that frame, before the frame's update.
    Expected<void> move(uint32_t frame, LightState& lights);
    // As they are lit now.
    Expected<std::vector<Sphere>> spheres(const LightState& lights) const;

   private:
    const Script* script_ = nullptr;
    std::vector<Model> models_;
    std::vector<glm::vec3> places_m_;
};

// There and back, at rest at both ends.
glm::vec3 placeOf(const Ball& ball, uint32_t frame);

}  // namespace dimmer::sample
