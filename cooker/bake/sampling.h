// Sample sequences and warps. Everything is a function of explicit indices: no state, the same on any thread.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>

namespace dimmer::cook {

inline constexpr float pi = std::numbers::pi_v<float>;

// An integer hash with full avalanche (the finaliser "lowbias32" found by C. Wellons' search, 2018).
inline uint32_t hash(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}
inline uint32_t hash(uint32_t a, uint32_t b) {
    return hash(a ^ hash(b + 0x9e3779b9u));
}

// [0, 1): 24 bits, exact in a float.
inline float unitFloat(uint32_t bits) {
    return static_cast<float>(bits >> 8) * 0x1p-24f;
}

// Sample i of the additive recurrence R2 (M. Roberts 2018: steps 1/g and 1/g^2, g^3 = g + 1), in 32-bit fixed point,
// shifted by a hash of `seed`: low discrepancy for every prefix, and independent between seeds.
inline glm::vec2 sequence2d(uint32_t i, uint32_t seed) {
    constexpr uint32_t step_x = 3242174889u, step_y = 2447445414u;
    return {unitFloat(hash(seed) + i * step_x), unitFloat(hash(seed ^ 0x68bc21ebu) + i * step_y)};
}

// The same in three dimensions: steps 1/g, 1/g^2 and 1/g^3, g^4 = g + 1.
inline glm::vec3 sequence3d(uint32_t i, uint32_t seed) {
    constexpr uint32_t step_x = 3518319155u, step_y = 2882110345u, step_z = 2360945575u;
    return {unitFloat(hash(seed) + i * step_x), unitFloat(hash(seed ^ 0x68bc21ebu) + i * step_y),
            unitFloat(hash(seed ^ 0x02e5be93u) + i * step_z)};
}

// Radical inverse, for Halton points.
inline float radicalInverse(uint32_t base, uint32_t i) {
    const float inverse_base = 1.0f / static_cast<float>(base);
    float digit_weight = inverse_base, sum = 0;
    for (; i > 0; i /= base, digit_weight *= inverse_base) sum += static_cast<float>(i % base) * digit_weight;
    return sum;
}

// Uniform on a triangle, as Hit::u and v.
inline glm::vec2 uniformOnTriangle(glm::vec2 u) {
    return std::sqrt(u.x) * glm::vec2(1 - u.y, u.y);
}

// Cosine-distributed direction about +Z: density cos(theta) / pi.
inline glm::vec3 cosineDirection(glm::vec2 u) {
    const float radius = std::sqrt(u.x), phi = 2 * pi * u.y;
    return {radius * std::cos(phi), radius * std::sin(phi), std::sqrt(std::max(0.0f, 1 - u.x))};
}

// Uniform over the cap of directions around +Z with cosines from `cos_min` to 1.
inline glm::vec3 uniformCapDirection(glm::vec2 u, float cos_min) {
    const float z = 1 - u.x * (1 - cos_min), radius = std::sqrt(std::max(0.0f, 1 - z * z)), phi = 2 * pi * u.y;
    return {radius * std::cos(phi), radius * std::sin(phi), z};
}

inline glm::vec3 uniformSphereDirection(glm::vec2 u) {
    return uniformCapDirection(u, -1);
}

// Two unit vectors that complete unit `n` to a right-handed frame (Duff et al. 2017).
inline void orthonormalBasis(glm::vec3 n, glm::vec3& t, glm::vec3& b) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z), c = n.x * n.y * a;
    t = {1 + sign * n.x * n.x * a, sign * c, -sign * n.x};
    b = {c, sign + n.y * n.y * a, -n.y};
}

inline float luminance(glm::vec3 c) {
    return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

}  // namespace dimmer::cook
