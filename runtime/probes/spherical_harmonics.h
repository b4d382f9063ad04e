// Real spherical harmonics, bands 0..2, in the order of a probe's bytes; orthonormal, without the Condon-Shortley
// phase, z the polar axis (Ramamoorthi and Hanrahan 2001, An efficient representation for irradiance environment maps).
#pragma once

#include <array>
#include <cstddef>

namespace dimmer {

inline constexpr size_t sh_count = 9;

// Y_lm at a unit direction: (0,0), (1,-1), (1,0), (1,1), (2,-2), (2,-1), (2,0), (2,1), (2,2).
inline std::array<float, sh_count> sphericalHarmonics(const std::array<float, 3>& d) {
    const auto [x, y, z] = d;
    return {0.282094792f,
            0.488602512f * y,
            0.488602512f * z,
            0.488602512f * x,
            1.092548431f * x * y,
            1.092548431f * y * z,
            0.315391565f * (3 * z * z - 1),
            1.092548431f * x * z,
            0.546274215f * (x * x - y * y)};
}

inline constexpr size_t bandOf(size_t coefficient) {
    return coefficient == 0 ? 0 : coefficient < 4 ? 1 : 2;
}

// Coefficients of the clamped cosine, as factors of a band: pi, 2 pi / 3, pi / 4 (Ramamoorthi and Hanrahan 2001).
inline constexpr std::array<float, 3> cosine_bands = {3.14159265f, 2.09439510f, 0.785398163f};
// sqrt(2l + 1): no coefficient of light that is nowhere negative exceeds so many times the first.
inline constexpr std::array<float, 3> band_bounds = {1, 1.73205081f, 2.23606798f};

}  // namespace dimmer
