#include <probes/grid_error.h>

#include <probes/spherical_harmonics.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <glm/glm.hpp>
#include <numeric>

namespace dimmer::cook {
namespace {

// Six along the axes and eight between: the corners and sides of a cube.
struct Normals {
    std::array<std::array<float, 9>, 14> transfer;  // irradiance = dot(transfer, radiance)
    Normals() {
        size_t n = 0;
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z) {
                    const int ones = std::abs(x) + std::abs(y) + std::abs(z);
                    if (ones != 1 && ones != 3) continue;
                    const glm::vec3 d = glm::normalize(glm::vec3(x, y, z));
                    transfer[n] = sphericalHarmonics({d.x, d.y, d.z});
                    for (size_t k = 0; k < 9; ++k) transfer[n][k] *= cosine_bands[bandOf(k)];
                    ++n;
                }
    }
};

}  // namespace

float gridError(const float* interpolated, const float* traced, float floor_lux, float error_max) {
    static const Normals normals;
    float sum = 0;
    for (const auto& transfer : normals.transfer) {
        const float is = std::max(0.0f, std::inner_product(transfer.begin(), transfer.end(), interpolated, 0.0f));
        const float should = std::max(0.0f, std::inner_product(transfer.begin(), transfer.end(), traced, 0.0f));
        sum += std::min(error_max, std::abs(is - should) / (should + floor_lux));
    }
    return sum / static_cast<float>(normals.transfer.size());
}

}  // namespace dimmer::cook
