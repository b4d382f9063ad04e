// The balls of a script and of a level: models that the runtime lights, and the spheres to draw.
#pragma once

#include "script.h"
#include "sphere_renderer.h"

#include <dimmer/pack.h>

#include <vector>

namespace dimmer::sample {

// Room that the runtime needs for them.
uint32_t movingProbes(const Script& script);

// One at each of the level's places for things that move (dimmer_dynamic on an empty node): there and back along the
// node's X axis. None where the pack has no global grid to light them.
std::vector<Ball> ballsAtPlaces(const Pack& pack);

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
