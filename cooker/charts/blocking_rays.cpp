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

constexpr float first_step_m = 1;    // of a ray; twice as far each time
constexpr float edge_share = 1e-4f;  // of a triangle; so near its edge the next may be met as well

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
    Met first{std::numeric_limits<float>::max(), false};
    lookAlong(from, direction, [&](std::span<const Place> places) {
        if (places.empty()) return false;
        first = {places[0].at_m, places[0].faces == 0};
        return true;
    });
    return first;
}

bool BlockingRays::startsInSolid(glm::vec3 from, glm::vec3 direction) const {
    bool in_solid = false;
    lookAlong(from, direction, [&](std::span<const Place> places) {
        int left = 0;  // more solids than were entered
        for (const Place& place : places) {
            if (place.on_edge) return true;
            left += place.backs - place.faces;
            if ((in_solid = left > 0)) return true;
        }
        return false;
    });
    return in_solid;
}

std::vector<BlockingRays::Place> BlockingRays::placesAlong(glm::vec3 from, glm::vec3 direction, float end_m) const {
    const float last_m = end_m + same_line_m;  // of what is at a place that begins before the end
    BoxTree::Box box = BoxTree::boxOf(std::array{from, from + last_m * direction});
    box.min_m -= same_line_m, box.max_m += same_line_m;
    std::vector<Place> met;
    for (const uint32_t near : boxes_.touching(box)) {
        glm::vec2 weights;
        float away_m = 0;
        const auto& [a, b, c] = face(near).corners_m;
        if (!glm::intersectRayTriangle(from, direction, a, b, c, weights, away_m)) continue;
        if (away_m < 0 || away_m > last_m) continue;
        const bool back = glm::dot(face(near).normal, direction) > 0 && !isDoubleSided(near);
        const float inside = std::min({weights.x, weights.y, 1 - weights.x - weights.y});
        met.push_back({away_m, back ? 0 : 1, back ? 1 : 0, inside < edge_share});
    }
    std::ranges::sort(met, {}, &Place::at_m);
    std::vector<Place> places;
    for (const Place& one : met) {
        if (places.empty() || one.at_m > places.back().at_m + same_line_m) {
            places.push_back(one);
            continue;
        }
        Place& same = places.back();
        same.faces += one.faces, same.backs += one.backs, same.on_edge |= one.on_edge;
    }
    if (!places.empty() && places.back().at_m > end_m) places.pop_back();
    return places;
}

void BlockingRays::lookAlong(glm::vec3 from, glm::vec3 direction,
                             const std::function<bool(std::span<const Place>)>& enough) const {
    float end_m = 0;  // of the level
    for (uint32_t i = 0; i < 8; ++i) {
        const glm::vec3 corner = glm::mix(level_.min_m, level_.max_m, glm::vec3(i & 1, i >> 1 & 1, i >> 2));
        end_m = std::max(end_m, glm::dot(corner - from, direction));
    }
    end_m += same_line_m + rounding_share * largest_m_;
    float done_m = first_step_m;
    while (!enough(placesAlong(from, direction, done_m)) && done_m < end_m) done_m *= 2;
}

}  // namespace dimmer::cook
