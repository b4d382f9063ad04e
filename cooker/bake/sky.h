// The sky as a light: what it looks like in a direction, and which directions are worth asking.
#pragma once

#include <scene/scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

// Radiance in cd/m2 that the sky sends from unit `direction`. An image's texels are areas of one radiance each: what
// interpolating between them would change is a texel wide, and so its light is exactly the sum of its texels.
glm::vec3 skyRadiance(const Scene& scene, glm::vec3 direction);

struct SkySample {
    glm::vec3 direction{0};  // unit
    glm::vec3 radiance_cd_m2{0};
    float pdf = 0;  // per steradian
};

// Draws directions of an image sky in proportion to its luminance (marginal and conditional tables over rows and
// columns). A constant sky needs none of this: cosine rays are right for it.
class SkySampler {
   public:
    explicit SkySampler(const Scene& scene);

    // Nothing to draw from: no image, or a black one.
    bool empty() const { return row_cdf_.empty(); }
    // `u` in [0, 1)^2.
    SkySample sample(glm::vec2 u) const;
    // The density with which sample() draws a direction that has this radiance.
    float pdf(glm::vec3 radiance_cd_m2) const;

   private:
    const Scene& scene_;
    std::vector<float> row_cdf_;     // up to and including each row; the last is 1
    std::vector<float> column_cdf_;  // the same within each row
    float flux_ = 0;                 // integral of luminance over all directions, cd/m2 sr
};

}  // namespace dimmer::cook
