#include <probes/air_box.h>

#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

namespace dimmer::cook {
namespace {

constexpr float headroom_m = 2.5f;     // over ground
constexpr float least_reach_m = 2.5f;  // beside a level, however small
constexpr uint32_t columns = 1024;
constexpr double ground_share_min = 0.5;  // of all columns: less are tops of walls
constexpr double ground_quantile = 0.9;   // single peaks aside
constexpr float below_m = 0.5f;           // farther down another surface makes the one above it a roof
constexpr int surfaces_max = 64;          // one above another

// Of the first surface that looks up, if air is over it and no other one is below.
std::optional<float> groundAt(const RayScene& rays, glm::vec3 from, float depth_m) {
    std::optional<float> ground;
    const float end_m = from.y - depth_m;
    for (int i = 0; i < surfaces_max; ++i) {
        const auto hit = rays.nearest(from, {0, -1, 0}, from.y - end_m, 0);
        if (!hit) break;
        const float height_m = from.y - hit->distance_m;
        if (!ground && hit->back) return std::nullopt;
        if (ground && !hit->back && *ground - height_m > below_m) return std::nullopt;
        if (!ground) ground = height_m;
        from.y = std::min(std::nextafter(from.y, end_m), height_m - 1e-4f);
        if (from.y <= end_m) break;
    }
    return ground;
}

float topOfOpenGround(const RayScene& rays) {
    const glm::vec3 low = rays.boundsMin(), size = rays.boundsMax() - low;
    std::vector<std::optional<float>> found(columns);
    tbb::parallel_for(0u, columns, [&](uint32_t i) {
        const glm::vec3 p = low + size * glm::vec3(radicalInverse(2, i + 1), 1, radicalInverse(3, i + 1));
        found[i] = groundAt(rays, p + glm::vec3(0, 1, 0), size.y + 2);
    });
    std::vector<float> heights;
    for (const auto& ground : found)
        if (ground) heights.push_back(*ground);
    if (static_cast<double>(heights.size()) < ground_share_min * columns) return low.y;
    const auto at = static_cast<size_t>(ground_quantile * static_cast<double>(heights.size() - 1));
    std::ranges::nth_element(heights, heights.begin() + static_cast<std::ptrdiff_t>(at));
    return heights[at];
}

// Corners of play areas and of what is dynamic, and places for that.
std::vector<glm::vec3> placesOfMotion(const Scene& scene) {
    std::vector<glm::vec3> places;
    for (const PlayArea& area : scene.play_areas) {
        const glm::mat4 world_from_box = glm::inverse(area.box_from_world);
        for (uint32_t i = 0; i < 8; ++i) {
            const glm::vec4 corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1, 1);
            places.emplace_back(world_from_box * corner);
        }
    }
    for (const DynamicPlace& place : scene.dynamic_places) places.emplace_back(glm::vec3(place.world_from_node[3]));
    for (const SceneMesh& mesh : scene.meshes) {
        if (mesh.lighting != Lighting::Dynamic || mesh.positions_m.empty()) continue;
        glm::vec3 low = mesh.positions_m[0], high = low;
        for (const glm::vec3 p : mesh.positions_m) low = glm::min(low, p), high = glm::max(high, p);
        places.push_back(low);
        places.push_back(high);
    }
    return places;
}

}  // namespace

Box airBox(const RayScene& rays) {
    const glm::vec3 low = rays.boundsMin(), high = rays.boundsMax(), size = high - low;
    const float reach_m = std::max({least_reach_m, size.x, size.y, size.z});
    Box box{low, high};
    for (const glm::vec3 place : placesOfMotion(rays.scene())) {
        box.min_m = glm::min(box.min_m, glm::max(place, low - reach_m));
        box.max_m = glm::max(box.max_m, glm::min(place, high + reach_m));
    }
    box.max_m.y = std::max(box.max_m.y, topOfOpenGround(rays) + headroom_m);
    return box;
}

}  // namespace dimmer::cook
