// The image sky of the reference: directions in proportion to what each texel sends. It shares what the sky looks like
// (skyRadiance) with the baker's SkySampler, and nothing else.
#pragma once

#include <scene/scene.h>

#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

class ReferenceSky {
   public:
    // `wanted`: else there is nothing to draw from, and no table.
    ReferenceSky(const Scene& scene, bool wanted);

    // Not wanted, no image, or a black one.
    bool empty() const { return !(flux_ > 0); }
    // Unit direction; `choice` picks the texel, `u` the place in it; all in [0, 1).
    glm::vec3 sample(float choice, glm::vec2 u) const;
    // The density per steradian with which sample() draws a direction that has this radiance; 0 where empty().
    float pdf(glm::vec3 radiance_cd_m2) const;

   private:
    const Scene& scene_;
    std::vector<double> up_to_;  // the flux of all texels until each, itself included, cd/m2 sr
    double flux_ = 0;            // of all
};

}  // namespace dimmer::cook
