// The sky as a light: what it looks like in a direction, and which directions are worth asking.
#pragma once

#include <scene/scene.h>

#include <array>
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
};

// Draws directions of an image sky in proportion to its brightest channel (marginal and conditional tables over rows
// and columns). A constant sky needs none of this: cosine rays are right for it. What outshines the rest, as the sun
// does, is drawn apart from it, by fixed numbers: else how many of a few samples find the sun is chance, and where all
// of them do, no spread tells that some should not have.
class SkySampler {
   public:
    enum Part : uint8_t { Rest, Peaks };

    explicit SkySampler(const Scene& scene);

    // Nothing to draw from: no image, or a black one.
    bool empty() const { return tables_[Rest].empty() && tables_[Peaks].empty(); }
    // How many of `samples` are drawn of a part: at least one of each that sends light, so that it may be one more.
    uint32_t samplesOf(Part part, uint32_t samples) const;
    // Of a part that has samples; `u` in [0, 1)^2.
    SkySample sample(Part part, glm::vec2 u) const;
    // How many of `samples` are drawn per steradian in a direction that has this radiance.
    float density(glm::vec3 radiance_cd_m2, uint32_t samples) const;

   private:
    struct Table {
        std::vector<float> row_cdf;     // up to and including each row; the last is 1
        std::vector<float> column_cdf;  // the same within each row
        float flux = 0;                 // integral of the brightest channel over the part's directions, cd/m2 sr
        bool empty() const { return row_cdf.empty(); }
    };
    Part partOf(glm::vec3 radiance_cd_m2) const;
    Table tableOf(Part part) const;

    const Scene& scene_;
    float peaks_above_;      // cd/m2, of the brightest channel
    float peaks_share_ = 0;  // of all flux
    std::array<Table, 2> tables_;
};

}  // namespace dimmer::cook
