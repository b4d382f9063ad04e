#include <charts/axes.h>

#include <cmath>

namespace dimmer::cook {

Axes::Axes(glm::vec3 n) {
    const glm::vec3 reference = std::abs(n.y) > 0.9f ? glm::vec3(0, 0, -1) : glm::vec3(0, 1, 0);
    u = glm::normalize(glm::cross(reference, n));
    v = glm::cross(n, u);
}

Axes::Axes(glm::vec3 n, glm::vec3 other_u) : Axes(n) {
    const glm::vec2 along = on(other_u);
    if (glm::length(along) > 0.1f) *this = turned(along);
}

Axes Axes::turned(glm::vec2 along) const {
    Axes axes = *this;
    axes.u = glm::normalize(along.x * u + along.y * v);
    axes.v = glm::normalize(along.x * v - along.y * u);
    return axes;
}

Rect Axes::rectOf(const PlanarFace& face) const {
    Rect rect;
    for (const glm::vec3 p : face.corners_m) rect.add(on(p));
    return rect;
}

}  // namespace dimmer::cook
