// The 8-byte lightmap texel and its arithmetic. GLSL twin, function by function: shaders/include/dimmer/texel.glsl.
// Both round alike wherever the device's +, *, / and sqrt are IEEE, so executors can be compared bit for bit.
//
//   irradiance  B10G11R11_UFLOAT_PACK32: E_z, irradiance on the texel's own normal, lux * exposure. Steps of 1/64
//               (r, g) and 1/32 (b) of the value; largest 65024 and 64512; rounded to nearest even; never NaN.
//   direction   R8G8B8A8_UNORM: byte 0 the ambient share r = v/255; bytes 1 and 2 m = (v - 128)/127, the highlight's
//               tangent part scaled by its share, (1 - r) d_xy; byte 3 spare (0). m rather than d, because a filtered
//               mean of m is again a meaningful m: a texel without direction pulls its neighbours towards none.
//
// The model ("ahd"): E(n) = E_z (r + (1-r) max(0, n.d) / d_z), a unit direction d with d_z >= 0.1. With the moment
// b = (1-r) d_xy / d_z it reads E(n) = E_z (r + max(0, b.n_xy + (1-r) n_z)); E_z r and E_z b add linearly.
#pragma once

#include <pack/pack_data.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace dimmer {

inline constexpr float luminance_r = 0.2126f, luminance_g = 0.7152f, luminance_b = 0.0722f;
inline constexpr float highlight_z_min = 0.1f;  // closer to the surface than this, (1-r)/d_z would outgrow 8 bits

inline float luminance(float r, float g, float b) {
    return luminance_r * r + luminance_g * g + luminance_b * b;
}

// Unsigned float with 5 exponent bits and `mantissa_bits` (5 or 6), round to nearest even. NaN and negative give 0;
// too large gives the largest finite value.
template <int mantissa_bits>
inline uint32_t encodeUfloat(float value) {
    constexpr int shift = 23 - mantissa_bits;
    constexpr uint32_t largest = (31u << mantissa_bits) - 1;
    if (!(value > 0)) return 0;
    // Below 2^-14 the steps are even: adding a number whose own step is just that rounds for us.
    if (value < 0x1p-14f) {
        const float magic = static_cast<float>(1 << (23 - 14 - mantissa_bits));
        return std::bit_cast<uint32_t>(value + magic) - std::bit_cast<uint32_t>(magic);
    }
    const uint32_t bits = std::bit_cast<uint32_t>(value);
    const uint32_t rounded = bits + ((1u << (shift - 1)) - 1) + (bits >> shift & 1);
    return std::min((rounded >> shift) - (112u << mantissa_bits), largest);
}

template <int mantissa_bits>
inline float decodeUfloat(uint32_t code) {
    constexpr uint32_t mantissa_mask = (1u << mantissa_bits) - 1;
    const uint32_t exponent = code >> mantissa_bits;
    if (exponent == 0) return static_cast<float>(code) * (mantissa_bits == 6 ? 0x1p-20f : 0x1p-19f);
    return std::bit_cast<float>((exponent + 112) << 23 | (code & mantissa_mask) << (23 - mantissa_bits));
}

inline uint32_t encodeR11G11B10(float r, float g, float b) {
    return encodeUfloat<6>(r) | encodeUfloat<6>(g) << 11 | encodeUfloat<5>(b) << 22;
}

inline std::array<float, 3> decodeR11G11B10(uint32_t code) {
    return {decodeUfloat<6>(code & 0x7ff), decodeUfloat<6>(code >> 11 & 0x7ff), decodeUfloat<5>(code >> 22)};
}

// Infinity and NaN codes (exponent 31) become the largest finite code of their channel; others stay as they are.
inline uint32_t clampR11G11B10(uint32_t code) {
    if ((code & 0x7c0u) == 0x7c0u) code = (code & ~0x7ffu) | 0x7bfu;
    if ((code >> 11 & 0x7c0u) == 0x7c0u) code = (code & ~(0x7ffu << 11)) | 0x7bfu << 11;
    if ((code >> 22 & 0x3e0u) == 0x3e0u) code = (code & ~(0x3ffu << 22)) | 0x3dfu << 22;
    return code;
}

// The directional part of a texel: ambient share and the highlight's moment b (see above).
struct Highlight {
    float ambient = 1;
    float bx = 0, by = 0;
};

inline Highlight highlightFromBytes(float ambient, float mx, float my) {
    const float share = 1.0f - ambient;
    if (!(share > 0)) return {};
    // q = share * d_z, from |m|^2 + q^2 = share^2; 8 bits may push |m| past share.
    const float m2 = mx * mx + my * my;
    const float q_min = highlight_z_min * share;
    const float q = std::sqrt(std::max(share * share - m2, q_min * q_min));
    const float scale = share / q;
    return {ambient, mx * scale, my * scale};
}

inline Highlight decodeDirection(uint32_t code) {
    constexpr float unorm = 1.0f / 255.0f, snorm = 1.0f / 127.0f;
    const float ambient = static_cast<float>(code & 0xff) * unorm;
    const float mx = (static_cast<float>(code >> 8 & 0xff) - 128.0f) * snorm;
    const float my = (static_cast<float>(code >> 16 & 0xff) - 128.0f) * snorm;
    return highlightFromBytes(ambient, mx, my);
}

// Below this luminance all three channels encode to 0; there, and only there, would sums be denormal numbers, which
// some devices flush to zero. Above the other bound squares could overflow; irradiance has saturated long before.
inline constexpr float direction_luminance_min = 0x1p-24f, direction_luminance_max = 0x1p40f;

// From sums over contributions: l = luminance of E_z, `ambient` = sum l r, (bx, by) = sum l b.
inline uint32_t encodeDirection(float l, float ambient, float bx, float by) {
    constexpr uint32_t none = 255u | 128u << 8 | 128u << 16;
    if (!(l >= direction_luminance_min && l <= direction_luminance_max)) return none;
    const float share = std::max(l - ambient, 0.0f);
    const float length = std::sqrt(bx * bx + by * by + share * share);
    if (!(length > 0)) return none;
    const float scale = share / (length * l);  // (1-r) / |D|
    const float r = std::min(std::max(ambient / l, 0.0f), 1.0f);
    const float mx = std::min(std::max(bx * scale, -1.0f), 1.0f);
    const float my = std::min(std::max(by * scale, -1.0f), 1.0f);
    const auto r8 = static_cast<uint32_t>(r * 255.0f + 0.5f);
    const auto x8 = static_cast<uint32_t>(mx * 127.0f + 128.5f);
    const auto y8 = static_cast<uint32_t>(my * 127.0f + 128.5f);
    return r8 | x8 << 8 | y8 << 16;
}

// Sums records with weights in 32-bit floats and encodes once. Order of the calls is part of the result.
struct TexelBlend {
    float r = 0, g = 0, b = 0;
    float l = 0, ambient = 0, bx = 0, by = 0;

    void add(TexelRecord record, float wr, float wg, float wb) {
        const auto [er, eg, eb] = decodeR11G11B10(record.irradiance);
        const Highlight h = decodeDirection(record.direction);
        const float cr = wr * er, cg = wg * eg, cb = wb * eb;
        const float cl = luminance(cr, cg, cb);
        r += cr;
        g += cg;
        b += cb;
        l += cl;
        ambient += cl * h.ambient;
        bx += cl * h.bx;
        by += cl * h.by;
    }
    TexelRecord encode() const { return {encodeR11G11B10(r, g, b), encodeDirection(l, ambient, bx, by)}; }
};

}  // namespace dimmer
