#include <charts/blocking_rays.h>

#include <charts/wall_traces.h>

#include <glm/gtx/intersect.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace dimmer::cook {
namespace {

constexpr float first_step_m = 1;  // of a ray; twice as far each time

}  // namespace

float largestOf(glm::vec3 p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

BlockingRays::BlockingRays(std::span<const PlanarFace> faces, Blocking blocking)
    : faces_(faces), blocking_(std::move(blocking)), level_{glm::vec3(0), glm::vec3(0)} {
    std::vector<BoxTree::Box> boxes;
    for (const uint32_t f : blocking_.faces) {
        const BoxTree::Box box = BoxTree::boxOf(faces_[f].corners_m);
        if (boxes.empty()) level_ = box;
        level_.min_m = glm::min(level_.min_m, box.min_m), level_.max_m = glm::max(level_.max_m, box.max_m);
        boxes.push_back(box);
    }
    largest_m_ = std::max(largestOf(level_.min_m), largestOf(level_.max_m));
    boxes_ = BoxTree(std::move(boxes));
}

BlockingRays::Met BlockingRays::meets(glm::vec3 from, glm::vec3 direction) const {
    float end_m = same_line_m + rounding_share * largest_m_;  // of the level
    for (uint32_t i = 0; i < 8; ++i) {
        const glm::vec3 corner = glm::mix(level_.min_m, level_.max_m, glm::vec3(i & 1, i >> 1 & 1, i >> 2));
        end_m = std::max(end_m, glm::dot(corner - from, direction));
    }
    constexpr float none = std::numeric_limits<float>::max();
    float face_m = none, back_m = none;
    float done_m = 0.5f * first_step_m;
    do {
        done_m *= 2;
        const float last_m = done_m + same_line_m;  // a face that touches a back may lie beyond the step
        BoxTree::Box box = BoxTree::boxOf(std::array{from, from + last_m * direction});
        box.min_m -= same_line_m, box.max_m += same_line_m;
        for (const uint32_t near : boxes_.touching(box)) {
            glm::vec2 weights;
            float away_m = 0;
            const auto& [a, b, c] = face(near).corners_m;
            if (!glm::intersectRayTriangle(from, direction, a, b, c, weights, away_m)) continue;
            if (away_m < 0 || away_m > last_m) continue;
            const bool is_back = glm::dot(face(near).normal, direction) > 0 && !isDoubleSided(near);
            float& nearest_m = is_back ? back_m : face_m;
            nearest_m = std::min(nearest_m, away_m);
        }
    } while (std::min(face_m, back_m) > done_m && done_m < end_m);
    return back_m < face_m - same_line_m ? Met{back_m, true} : Met{face_m, false};
}

}  // namespace dimmer::cook
