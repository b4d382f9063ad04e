#include <bake/light_grid.h>

#include <bake/door_paths.h>
#include <bake/punctual.h>
#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace dimmer::cook {
namespace {

// Lights further outside of the level are no lamps of its: their rays would miss it.
constexpr float margin_m = 20;

// The light's place and direction, not its intensity: a dimmed lamp keeps its noise.
uint32_t identityOf(const PunctualLight& light) {
    uint32_t id = static_cast<uint32_t>(light.type);
    for (const glm::vec3 v : {light.position_m, light.direction})
        for (int c = 0; c < 3; ++c) id = hash(id, std::bit_cast<uint32_t>(v[c]));
    return id;
}

// Direction i of n, evenly over the cap of directions within `cos_least` of the axis (a spherical Fibonacci set).
glm::vec3 capDirection(uint32_t i, uint32_t n, float cos_least, glm::vec3 axis) {
    constexpr float golden_angle = 2.39996323f;
    const float z = 1 - (1 - cos_least) * (static_cast<float>(i) + 0.5f) / static_cast<float>(n);
    const float across = std::sqrt(std::max(0.0f, 1 - z * z)), phi = golden_angle * static_cast<float>(i);
    glm::vec3 t, b;
    orthonormalBasis(axis, t, b);
    return t * (across * std::cos(phi)) + b * (across * std::sin(phi)) + axis * z;
}

// Points of surfaces, evenly over their area, in an order of no importance.
std::vector<glm::vec3> pointsOfSurfaces(const RayScene& rays) {
    std::vector<double> area_m2{0};  // up to each triangle
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
        const glm::vec3 a = rays.corner(t, 0), b = rays.corner(t, 1), c = rays.corner(t, 2);
        area_m2.push_back(area_m2.back() + static_cast<double>(glm::length(glm::cross(b - a, c - a))) / 2);
    }
    constexpr double cell_m2 = static_cast<double>(LightGrid::cell_min_m) * static_cast<double>(LightGrid::cell_min_m);
    constexpr double most = 1e6;
    const auto count = static_cast<uint32_t>(std::clamp(area_m2.back() / cell_m2, double{surface_points}, most));
    std::vector<glm::vec3> points;
    for (uint32_t i = 0, t = 0; i < count && area_m2.back() > 0; ++i) {
        const double at = area_m2.back() * (i + 0.5) / count;
        while (area_m2[t + 1] < at) ++t;
        const glm::vec2 u = sequence2d(i, 0);
        const float across = std::sqrt(u.x);  // evenly over the triangle
        points.push_back(rays.pointOn(t, across * (1 - u.y), across * u.y));
    }
    return points;
}

}  // namespace

LightGrid::LightGrid(const RayScene& rays, bool enabled, std::span<const uint8_t> groups, Progress* progress) {
    const auto isFarOutside = [&](glm::vec3 p) {
        return glm::distance(p, glm::clamp(p, rays.boundsMin(), rays.boundsMax())) > margin_m;
    };
    const auto& lights = rays.scene().lights;
    std::vector<uint32_t> sought;
    for (uint32_t l = 0; l < lights.size(); ++l) {
        const PunctualLight& light = lights[l];
        identity_.push_back(identityOf(light));
        const bool asked = groups.empty() || groups[groupOf(light.light_set)];
        if (light.bake == BakeMode::None || light.intensity == glm::vec3(0) || !asked) continue;
        const bool unlisted = !enabled || light.type == LightType::Directional || light.bake == BakeMode::Full ||
                              isFarOutside(light.position_m);
        (unlisted ? everywhere_ : sought).push_back(l);
    }
    if (sought.empty()) return;
    grid_ = {rays.boundsMin(), rays.boundsMax(), cell_min_m};

    std::vector<std::vector<uint32_t>> reached(sought.size());
    const std::vector<glm::vec3> points = pointsOfSurfaces(rays);
    if (progress) progress->stage("rays from lamps", sought.size());
    tbb::parallel_for(size_t{0}, sought.size(), [&](size_t i) {
        reached[i] = reachedCells(rays, points, sought[i]);
        if (progress) progress->advance(1);
    });
    first_.assign(grid_.count() + 1, 0);
    for (const auto& cells : reached)
        for (const uint32_t cell : cells) ++first_[cell + 1];
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    lights_.resize(first_.back());
    std::vector<uint64_t> end(first_.begin(), first_.end() - 1);
    for (size_t i = 0; i < reached.size(); ++i)
        for (const uint32_t cell : reached[i]) lights_[end[cell]++] = sought[i];
}

std::vector<uint32_t> LightGrid::reachedCells(const RayScene& rays, std::span<const glm::vec3> surface_points_m,
                                              uint32_t index) const {
    const PunctualLight& light = rays.scene().lights[index];
    const float cos_least = light.type == LightType::Spot ? light.cone_outer_cos : -1;
    // No further than the level goes, whatever range a file states.
    const float across_m = glm::length(rays.boundsMax() - rays.boundsMin()) + 2 * margin_m;
    const float far_m = std::min(light.range_m.value_or(across_m), across_m);
    // The way to the neighbouring rays, per metre: no direction is further from its nearest ray, so that in the open
    // nothing is missed however far.
    const float spread = std::sqrt(2 * pi * (1 - cos_least) / static_cast<float>(light_probe_rays));
    std::vector<uint8_t> marks(grid_.count());
    // How far a ray goes: through doors, as what is behind them is lit once they open, and through panes, however
    // little they let by.
    const auto reach = [&](glm::vec3 d, float length_m) {
        return rays.reach(light.position_m + d * lamp_lift_m, d, length_m, Surfaces::Walls);
    };
    const auto mark = [&](glm::vec3 d, float length_m) {
        grid_.mark(light.position_m + d * lamp_lift_m, d, length_m, spread, marks);
    };
    for (uint32_t i = 0; i < light_probe_rays; ++i) {
        const glm::vec3 d = capDirection(i, light_probe_rays, cos_least, light.direction);
        mark(d, reach(d, far_m));
    }
    for (const glm::vec3 point : surface_points_m) {
        const glm::vec3 way = point - light.position_m;
        const float length_m = glm::length(way);
        if (!(length_m > lamp_lift_m && length_m < far_m) || marks[grid_.at(point)]) continue;
        const glm::vec3 d = way / length_m;
        if (light.type == LightType::Spot && glm::dot(d, light.direction) < cos_least) continue;
        const float rounding_m = 1e-3f + 1e-5f * length_m;  // more than a hit is rounded by
        const float reached_m = reach(d, length_m);
        if (reached_m + lamp_lift_m > length_m - rounding_m) mark(d, reached_m);
    }
    std::vector<uint32_t> cells;
    for (uint32_t c = 0; c < marks.size(); ++c)
        if (marks[c]) cells.push_back(c);
    return cells;
}

std::span<const uint32_t> LightGrid::listed(glm::vec3 point) const {
    if (first_.empty()) return {};
    const uint32_t cell = grid_.at(point);
    return {lights_.data() + first_[cell], first_[cell + 1] - first_[cell]};
}

}  // namespace dimmer::cook
