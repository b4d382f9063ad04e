// How much a pack's light for what moves jumps from step to step: lines through the open, as far off surfaces as
// models' own probes stay, read each centimetre on six normals, all sets on.
//   build/bin/dimmer_grid_steps LEVEL PACK
#include <bake/sampling.h>
#include <probes/free_space.h>

#include <dimmer/cpu_runtime.h>
#include <dimmer/probe_grid.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace dimmer::cook {
namespace {

constexpr uint32_t lines = 4000, steps_of_line = 50, seed = 1;
constexpr float step_m = 0.01f;
constexpr float floor_of_mean = 0.01f;  // as error measures have it
constexpr std::array<std::array<float, 3>, 6> normals = {
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};

using Light = std::array<float, normals.size()>;

Light lightAt(const GridSampler& grid, glm::vec3 p) {
    Light lux;
    for (size_t i = 0; i < normals.size(); ++i) {
        const auto e = grid.sample({p.x, p.y, p.z}, normals[i]);
        lux[i] = luminance({e[0], e[1], e[2]});
    }
    return lux;
}

struct Step {
    float change_lux, mean_lux;
};

// Of one line, as far as it stays in the open; one for each normal.
void walk(const RayScene& rays, const GridSampler& grid, glm::vec3 start, glm::vec3 way, std::vector<Step>& steps) {
    Light before = lightAt(grid, start);
    for (uint32_t k = 1; k <= steps_of_line; ++k) {
        const glm::vec3 p = start + step_m * static_cast<float>(k) * way;
        if (rays.blocked(p - step_m * way, p + probe_clearance_m * way) || !inTheOpen(rays, p)) return;
        const Light now = lightAt(grid, p);
        for (size_t n = 0; n < now.size(); ++n)
            steps.push_back({std::abs(now[n] - before[n]), (now[n] + before[n]) / 2});
        before = now;
    }
}

// Ascending shares of the light that is there.
std::vector<double> sharesOf(const std::vector<Step>& steps) {
    double sum = 0;
    for (const Step& s : steps) sum += static_cast<double>(s.mean_lux);
    const double floor_lux = static_cast<double>(floor_of_mean) * sum / static_cast<double>(steps.size());
    std::vector<double> shares;
    for (const Step& s : steps)
        shares.push_back(static_cast<double>(s.change_lux) / (static_cast<double>(s.mean_lux) + floor_lux));
    std::ranges::sort(shares);
    return shares;
}

int run(const char* level, const char* file) {
    const auto scene = importLevel(level);
    const auto pack = Pack::open(file);
    if (!scene || !pack) {
        fmt::print(stderr, "{}\n", scene ? pack.error().message : scene.error().message);
        return 1;
    }
    CpuRuntime lights(*pack);
    lights.update();
    const GridSampler grid(*pack, lights.probes());
    const RayScene rays(*scene);
    std::vector<Step> steps;
    uint32_t line = 0;
    for (const glm::vec3 start : openPlaces(rays, lines, seed))
        walk(rays, grid, start, uniformSphereDirection(sequence2d(line++, seed)), steps);
    if (grid.empty() || steps.empty()) {
        fmt::print(stderr, "{}: no global light grid, or no air\n", file);
        return 1;
    }
    const std::vector<double> shares = sharesOf(steps);
    fmt::print("{} steps; changes:", shares.size() / normals.size());
    for (const double q : {0.5, 0.95, 0.99, 0.999, 1.0})
        fmt::print(" {:.1f} % {:.2f} %", 100 * q,
                   100 * shares[static_cast<size_t>(q * static_cast<double>(shares.size() - 1))]);
    fmt::print("; of a million:");
    for (const double limit : {0.05, 0.1, 0.2, 0.5})
        fmt::print(" {:.0f} above {:.0f} %",
                   1e6 * static_cast<double>(shares.end() - std::ranges::upper_bound(shares, limit)) /
                       static_cast<double>(shares.size()),
                   100 * limit);
    fmt::print("\n");
    return 0;
}

}  // namespace
}  // namespace dimmer::cook

int main(int argc, char** argv) {
    if (argc == 3) return dimmer::cook::run(argv[1], argv[2]);
    fmt::print(stderr, "usage: dimmer_grid_steps LEVEL PACK\n");
    return 2;
}
