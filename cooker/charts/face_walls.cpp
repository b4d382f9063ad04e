#include <charts/face_walls.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace dimmer::cook {
namespace {

// Within one plane, as charts tell them apart, and the normals of its faces: by how much heights over it differ.
constexpr float height_slack_m = 0.02f, height_slack_per_m = 1.0f / 256;
// From the edge of a face towards its middle, where lines to other faces begin.
constexpr float step_in = 0.01f;
// Rays are as exact as coordinates: 8e-6 m at 100 m.
constexpr float ray_slack_m = 1e-4f, ray_slack_per_m = 1e-6f;
// With more than so many things around a face each line between points is asked for.
constexpr size_t shadows_max = 512;

}  // namespace

FaceWalls::FaceWalls(const PlanarFace& face, const Axes& axes, const Reach& reach, const Standing& standing)
    : face_(face),
      axes_(axes),
      reach_(reach),
      standing_(standing),
      shadows_(standing.triangles ? shadowsNear(standing) : std::nullopt) {}

bool FaceWalls::part(const PlanarFace& other) const {
    return mayPart(axes_.rectOf(face_), axes_.rectOf(other)) && (between(face_, other) || between(other, face_));
}

std::optional<std::vector<Rect>> FaceWalls::shadowsNear(const Standing& standing) const {
    Rect rect = axes_.rectOf(face_);
    // Lines begin so far from where faces end.
    const float look_m = reach_.near_m + step_in * reach_.largest_m;
    const float slack_m = height_slack_m + height_slack_per_m * (look_m + glm::length(rect.max - rect.min));
    rect.min -= look_m, rect.max += look_m;
    const glm::vec3 normal = glm::cross(axes_.u, axes_.v);
    const float probe_m = glm::dot(normal, face_.corners_m[0]) + wall_probe_high_m;
    const float low = probe_m + reach_.lowest_m - slack_m, high = probe_m + reach_.highest_m + slack_m;
    std::vector<glm::vec3> corners;
    for (const float height : {low, high})
        for (const float u : {rect.min.x, rect.max.x})
            for (const float v : {rect.min.y, rect.max.y})
                corners.push_back(axes_.u * u + axes_.v * v + normal * height);
    std::vector<Rect> shadows;
    for (const auto& triangle : standing.triangles(BoxTree::boxOf(corners))) {
        const glm::vec3 across = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
        if (std::abs(glm::dot(across, normal)) >= reach_.flat_cos * glm::length(across)) continue;
        Rect shadow = shadowBetween(triangle, low, high);
        if (!(shadow.min.x <= shadow.max.x)) continue;
        const glm::vec2 largest = glm::max(glm::abs(shadow.min), glm::abs(shadow.max));
        const float ray_slack = ray_slack_m + ray_slack_per_m * std::max(largest.x, largest.y);
        shadow.min -= ray_slack, shadow.max += ray_slack;
        if (shadow.touches(rect)) shadows.push_back(shadow);
        if (shadows.size() > shadows_max) return std::nullopt;
    }
    return shadows;
}

// Where in the plane a triangle is between two heights.
Rect FaceWalls::shadowBetween(const std::array<glm::vec3, 3>& triangle, float low, float high) const {
    const glm::vec3 normal = glm::cross(axes_.u, axes_.v);
    Rect shadow;
    for (size_t i = 0; i < 3; ++i) {
        const glm::vec3 a = triangle[i], b = triangle[(i + 1) % 3];
        const float height_a = glm::dot(normal, a), height_b = glm::dot(normal, b);
        if (height_a >= low && height_a <= high) shadow.add(axes_.on(a));
        for (const float height : {low, high})
            if ((height_a < height) != (height_b < height))
                shadow.add(axes_.on(glm::mix(a, b, (height - height_a) / (height_b - height_a))));
    }
    return shadow;
}

bool FaceWalls::mayPart(Rect a, const Rect& b) const {
    a.add(b);
    return !shadows_ || std::ranges::any_of(*shadows_, [&](const Rect& shadow) { return shadow.touches(a); });
}

bool FaceWalls::between(const PlanarFace& a, const PlanarFace& b) const {
    for (size_t e = 0; e < 3; ++e)
        for (const float s : {0.02f, 0.25f, 0.5f, 0.75f}) {
            glm::vec3 p = glm::mix(a.corners_m[e], a.corners_m[(e + 1) % 3], s);
            glm::vec3 q = nearestOnEdges(b, p);
            const float distance = glm::length(q - p);
            if (distance < touching_m || distance > reach_.near_m) continue;
            // Step off the edges, on which the wall itself may stand.
            p += step_in * (middleOf(a) - p);
            q += step_in * (middleOf(b) - q);
            const glm::vec2 on_p = axes_.on(p), on_q = axes_.on(q);
            if (!mayPart({on_p, on_p}, {on_q, on_q})) continue;
            if (!wallBetween(p, q)) continue;
            if (!isInWall(p) && !isInWall(q)) return true;
            const auto from = outOfWalls(p, a), to = outOfWalls(q, b);
            if (wallBetween(from[0], to[0]) && wallBetween(from[1], to[1])) return true;
        }
    return false;
}

bool FaceWalls::wallBetween(glm::vec3 p, glm::vec3 q) const {
    return std::ranges::all_of(std::array{wall_probe_low_m, wall_probe_high_m}, [&](float height_m) {
        const glm::vec3 from = p + lift(height_m), to = q + lift(height_m);
        return standing_.blocked(from, to) || standing_.blocked(to, from);
    });
}

bool FaceWalls::isInWall(glm::vec3 p) const {
    return standing_.inside && standing_.inside(p + lift(wall_probe_low_m), axes_);
}

// Two open places on the way to the face's middle: where the open begins, and as much further as faces are asked for. A
// face goes on to the middle of the wall that it was cut at, and from in there the rest of its own room is beyond the
// wall; from where the open begins it may be behind the wall's end.
std::array<glm::vec3, 2> FaceWalls::outOfWalls(glm::vec3 p, const PlanarFace& face) const {
    const glm::vec3 middle = middleOf(face);
    for (const float share : {0.0f, 0.05f, 0.1f, 0.2f, 0.4f, 0.7f, 1.0f}) {
        const glm::vec3 first = glm::mix(p, middle, share);
        if (isInWall(first)) continue;
        const float left_m = glm::distance(first, middle);
        const glm::vec3 second = left_m > reach_.near_m ? glm::mix(first, middle, reach_.near_m / left_m) : middle;
        return {first, isInWall(second) ? first : second};
    }
    return {p, p};
}

glm::vec3 FaceWalls::lift(float height_m) const {
    return glm::cross(axes_.u, axes_.v) * height_m;
}

glm::vec3 middleOf(const PlanarFace& face) {
    return (face.corners_m[0] + face.corners_m[1] + face.corners_m[2]) / 3.0f;
}

glm::vec3 nearestOnEdges(const PlanarFace& face, glm::vec3 p) {
    glm::vec3 best = face.corners_m[0];
    float best2 = 1e30f;
    for (size_t e = 0; e < 3; ++e) {
        const glm::vec3 a = face.corners_m[e], ab = face.corners_m[(e + 1) % 3] - a;
        const float s = std::clamp(glm::dot(p - a, ab) / glm::dot(ab, ab), 0.0f, 1.0f);
        const glm::vec3 q = a + s * ab;
        const float d2 = glm::dot(q - p, q - p);
        if (d2 < best2) best2 = d2, best = q;
    }
    return best;
}

}  // namespace dimmer::cook
