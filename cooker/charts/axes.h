// Along the planes of charts.
#pragma once

#include <charts/planar.h>
#include <charts/polygon.h>

#include <glm/glm.hpp>

namespace dimmer::cook {

// Unit, at right angles: u x v is the plane's normal.
struct Axes {
    glm::vec3 u, v;
    explicit Axes(glm::vec3 n);
    // With the first one as near to another plane's as it can be.
    Axes(glm::vec3 n, glm::vec3 other_u);
    // With `along` of these axes as the first one.
    Axes turned(glm::vec2 along) const;
    glm::vec2 on(glm::vec3 p) const { return {glm::dot(p, u), glm::dot(p, v)}; }
    Rect rectOf(const PlanarFace& face) const;
};

}  // namespace dimmer::cook
