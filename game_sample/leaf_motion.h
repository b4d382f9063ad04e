// How this game moves its doors: every leaf slides sideways into the wall, two leaves of one door away from each other.
#pragma once

#include <dimmer/light_state.h>

#include <glm/glm.hpp>
#include <vector>

namespace dimmer::sample {

class LeafMotion {
   public:
    explicit LeafMotion(const Pack& pack);
    // Where a mesh of the pack stands now, from where it was baked. Metres; zero for what is no leaf.
    glm::vec3 offset(size_t mesh, const LightState& lights) const;

   private:
    std::vector<std::optional<Door>> door_;  // per mesh
    std::vector<glm::vec3> travel_m_;        // per mesh, of its open door
};

}  // namespace dimmer::sample
