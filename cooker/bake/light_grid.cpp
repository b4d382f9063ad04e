#include <bake/light_grid.h>

#include <bake/door_paths.h>
#include <bake/punctual.h>
#include <bake/reached_cells.h>
#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>

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

struct SurfacePoint {
    glm::vec3 position_m;
    glm::vec3 normal;  // 0 where both sides are lit
};

// Evenly over their area, in an order of no importance.
std::vector<SurfacePoint> pointsOfSurfaces(const RayScene& rays) {
    std::vector<double> area_m2{0};  // up to each triangle
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
        const glm::vec3 a = rays.corner(t, 0), b = rays.corner(t, 1), c = rays.corner(t, 2);
        area_m2.push_back(area_m2.back() + static_cast<double>(glm::length(glm::cross(b - a, c - a))) / 2);
    }
    constexpr double cell_m2 = static_cast<double>(LightGrid::cell_m) * static_cast<double>(LightGrid::cell_m);
    constexpr double most = 1e6;
    const auto count = static_cast<uint32_t>(std::clamp(area_m2.back() / cell_m2, double{surface_points}, most));
    std::vector<SurfacePoint> points;
    for (uint32_t i = 0, t = 0; i < count && area_m2.back() > 0; ++i) {
        const double at = area_m2.back() * (i + 0.5) / count;
        while (area_m2[t + 1] < at) ++t;
        const glm::vec2 on = uniformOnTriangle(sequence2d(i, 0));
        const LevelTriangle& triangle = rays.triangles()[t];
        const bool both_sides = rays.scene().materials[triangle.material].double_sided;
        points.push_back({rays.pointOn(t, on.x, on.y), both_sides ? glm::vec3(0) : triangle.normal});
    }
    return points;
}

std::vector<uint64_t> reachedCells(const RayScene& rays, const CellLevels& levels,
                                   std::span<const SurfacePoint> surface_points, const PunctualLight& light) {
    const float cos_least = light.type == LightType::Spot ? light.cone_outer_cos : -1;
    // No further than the level goes, whatever range a file states.
    const float across_m = glm::length(rays.boundsMax() - rays.boundsMin()) + 2 * margin_m;
    const float far_m = std::min(light.range_m.value_or(across_m), across_m);
    // The way to the neighbouring rays, per metre: no direction is further from its nearest ray, so that in the open
    // nothing is missed however far.
    const float spread = std::sqrt(2 * pi * (1 - cos_least) / static_cast<float>(light_probe_rays));
    ReachedCells cells(levels, light.position_m, far_m, spread);
    // How far a ray goes: through doors, as what is behind them is lit once they open, and through panes, however
    // little they let by.
    const auto reach = [&](glm::vec3 d, float length_m) {
        return rays.reach(light.position_m + d * lamp_lift_m, d, length_m, Surfaces::Walls);
    };
    const auto mark = [&](glm::vec3 d, float length_m) { cells.mark(light.position_m + d * lamp_lift_m, d, length_m); };
    for (uint32_t i = 0; i < light_probe_rays; ++i) {
        const glm::vec3 d = capDirection(i, light_probe_rays, cos_least, light.direction);
        mark(d, reach(d, far_m));
    }
    for (uint32_t i = 0; i < surface_points.size(); ++i) {
        const auto& [point, normal] = surface_points[i];
        const glm::vec3 way = point - light.position_m;
        const float length_m = glm::length(way);
        if (!(length_m > lamp_lift_m && length_m < far_m) || glm::dot(normal, way) > 0) continue;
        const uint32_t level = cells.levelAt(length_m);
        const uint64_t one_in = uint64_t{1} << 2 * level;  // one for a cell that is marked there
        if (i % one_in != 0 || cells.holds(point, level)) continue;
        const glm::vec3 d = way / length_m;
        if (light.type == LightType::Spot && glm::dot(d, light.direction) < cos_least) continue;
        const float rounding_m = 1e-3f + 1e-5f * length_m;  // more than a hit is rounded by
        const float reached_m = reach(d, length_m);
        if (reached_m + lamp_lift_m > length_m - rounding_m) mark(d, reached_m);
    }
    return cells.numbers();
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
        group_.push_back(groupOf(light.light_set));
        const bool asked = groups.empty() || groups[groupOf(light.light_set)];
        if (light.bake == BakeMode::None || light.intensity == glm::vec3(0) || !asked) continue;
        const bool unlisted = !enabled || light.type == LightType::Directional || light.bake == BakeMode::Full ||
                              isFarOutside(light.position_m);
        (unlisted ? everywhere_ : sought).push_back(l);
    }
    auto cells = std::make_shared<Cells>();
    if (!sought.empty()) {
        cells->levels = {rays.boundsMin(), rays.boundsMax(), cell_m};
        std::vector<std::vector<uint64_t>> reached(sought.size());
        const std::vector<SurfacePoint> points = pointsOfSurfaces(rays);
        if (progress) progress->stage("rays from lamps", sought.size());
        tbb::parallel_for(size_t{0}, sought.size(), [&](size_t i) {
            reached[i] = reachedCells(rays, cells->levels, points, lights[sought[i]]);
            if (progress) progress->advance(1);
        });
        fill(*cells, sought, reached);
        cells->all = std::move(sought);
    }
    cells_ = std::move(cells);
}

// `reached`: per light, which cells.
void LightGrid::fill(Cells& cells, std::span<const uint32_t> lights, std::span<const std::vector<uint64_t>> reached) {
    for (const auto& numbers : reached) cells.numbers.insert(cells.numbers.end(), numbers.begin(), numbers.end());
    std::ranges::sort(cells.numbers);
    cells.numbers.erase(std::unique(cells.numbers.begin(), cells.numbers.end()), cells.numbers.end());
    cells.numbers.shrink_to_fit();
    const auto indexOf = [&](uint64_t number) {
        return static_cast<size_t>(std::ranges::lower_bound(cells.numbers, number) - cells.numbers.begin());
    };
    cells.first.assign(cells.numbers.size() + 1, 0);
    for (const auto& numbers : reached)
        for (const uint64_t number : numbers) ++cells.first[indexOf(number) + 1];
    for (size_t i = 1; i < cells.first.size(); ++i) cells.first[i] += cells.first[i - 1];
    cells.lights.resize(cells.first.back());
    std::vector<uint64_t> end(cells.first.begin(), cells.first.end() - 1);
    for (size_t i = 0; i < reached.size(); ++i)
        for (const uint64_t number : reached[i]) cells.lights[end[indexOf(number)]++] = lights[i];
}

LightGrid LightGrid::ofGroups(std::span<const uint8_t> groups) const {
    LightGrid some = *this;
    if (groups.empty()) return some;
    some.told_.assign(groups.begin(), groups.end());
    std::erase_if(some.everywhere_, [&](uint32_t light) { return !some.tells(light); });
    return some;
}

std::vector<uint32_t> LightGrid::listed(glm::vec3 point) const {
    std::vector<uint32_t> found;
    const Cells& cells = *cells_;
    if (cells.levels.isOutside(point)) {
        std::ranges::copy_if(cells.all, std::back_inserter(found), [&](uint32_t light) { return tells(light); });
        return found;
    }
    for (uint32_t l = 0; l < cells.levels.count(); ++l) {
        const uint64_t number = cells.levels.number(cells.levels.coordinates(point, l), l);
        const auto at = std::ranges::lower_bound(cells.numbers, number);
        if (at == cells.numbers.end() || *at != number) continue;
        const auto cell = static_cast<size_t>(at - cells.numbers.begin());
        for (uint64_t i = cells.first[cell]; i < cells.first[cell + 1]; ++i)
            if (tells(cells.lights[i])) found.push_back(cells.lights[i]);
    }
    std::ranges::sort(found);
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

}  // namespace dimmer::cook
