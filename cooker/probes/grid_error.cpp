#include <probes/grid_error.h>

#include <probes/spherical_harmonics.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <glm/glm.hpp>

namespace dimmer::cook {
namespace {

// Normals: six along the axes and eight between, the corners and sides of a cube.
constexpr size_t normals = 14;
using Eight [[gnu::vector_size(32)]] = float;
using Irradiance = std::array<Eight, 2>;  // on each normal, and two that count for nothing

// Per coefficient of radiance what it counts for in the irradiance on each normal.
struct Transfer {
    std::array<Irradiance, 9> of{};
    Transfer() {
        size_t n = 0;
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z) {
                    const int ones = std::abs(x) + std::abs(y) + std::abs(z);
                    if (ones != 1 && ones != 3) continue;
                    const glm::vec3 d = glm::normalize(glm::vec3(x, y, z));
                    const auto harmonics = sphericalHarmonics({d.x, d.y, d.z});
                    for (size_t k = 0; k < 9; ++k) of[k][n / 8][n % 8] = harmonics[k] * cosine_bands[bandOf(k)];
                    ++n;
                }
    }
};

// Not below 0.
void addUp(const Transfer& transfer, const float* radiance, Irradiance& sum) {
    for (size_t k = 0; k < 9; ++k)
        for (size_t i = 0; i < 2; ++i) sum[i] += transfer.of[k][i] * radiance[k];
    for (Eight& lux : sum) lux = lux > 0 ? lux : Eight{};
}

}  // namespace

float gridError(const float* interpolated, const float* traced, float floor_lux, float error_max) {
    static const Transfer transfer;
    Irradiance is{}, should{};
    addUp(transfer, interpolated, is);
    addUp(transfer, traced, should);
    float sum = 0;
    for (size_t i = 0; i < 2; ++i) {
        const Eight off = is[i] - should[i], error = (off < 0 ? -off : off) / (should[i] + floor_lux);
        for (size_t lane = 0; lane < 8 && 8 * i + lane < normals; ++lane) sum += std::min(error_max, error[lane]);
    }
    return sum / static_cast<float>(normals);
}

}  // namespace dimmer::cook
