// Lamps whose beam is so narrow at a texel that its few points do not tell how much light it gets.
#pragma once

#include <bake/gather.h>

#include <optional>
#include <vector>

namespace dimmer::cook {

// A place of a texel that a beam falls on.
struct BeamPlace {
    SamplePoint point;
    glm::vec3 lux;  // what the light that it stands for adds to the texel's mean irradiance, nothing in its way
};

// What of a lamp's light is in a cone about an axis, and where that falls in a receiver.
struct NarrowBeam {
    glm::vec3 axis;
    float cosine;  // of the half angle
    std::vector<BeamPlace> places;

    bool holds(glm::vec3 towards_light) const { return glm::dot(axis, -towards_light) >= cosine; }
};

// Of a lamp's cones (bake/punctual.h) the widest that is narrow here: of 1,024 directions spread over it, which carry
// intensity times solid angle and land in one texel each, so that no light is lost or found twice. What lies outside of
// it the receiver's points find, as all where there is none: from three texels' widths across the beam on, and where it
// is not known what the texel is of. Thread-safe. Cost: some 20 microseconds where the beam passes near by, little
// elsewhere; all texels together get 1,024 places.
std::optional<NarrowBeam> narrowBeam(const Gatherer& gatherer, const GatherFrom& from, const PunctualLight& light);

}  // namespace dimmer::cook
