// The 8-byte lightmap texel and its arithmetic. GLSL twin, function by function: shaders/include/dimmer/texel.glsl.
// Both round alike wherever a device's + and * do as IEEE says (reciprocal.h): executors can be compared bit for bit.
//
//   irradiance  E_z, irradiance on the texel's own normal, lux * exposure, in one of two formats:
//               B10G11R11_UFLOAT_PACK32: steps of 1/64 (r, g) and 1/32 (b) of the value; largest 65024 and 64512;
//               rounded to nearest even; below 2^-14 it is 0, as some devices flush what is less; never NaN.
//               E5B9G9R9_UFLOAT_PACK32: three 9-bit mantissas under one exponent, that of the largest channel: steps
//               of 1/512 to 1/256 of that channel, 2^-24 at the least; largest 65408; rounded to nearest, ties up.
//   direction   A2B10G10R10_UNORM_PACK32, all linear: r = c0 / 1023, the ambient share; b_x, b_y = (c - 512) 5/256,
//               the highlight's moment; the top 2 bits are spare (0).
//
// The model "ahd": E(n) = E_z (r + (1-r) max(0, n.d) / d_z), a unit direction d with d_z >= 0.1. With the moment
// b = (1-r) d_xy / d_z it reads E(n) = E_z (r + max(0, b.n_xy + (1-r) n_z)); E_z r and E_z b add linearly, so a sum of
// texels has the mean of their direction codes, weighted with luminance: neither decoding nor encoding is needed.
// The model "linear" has the same moments and clamps their sum instead: E(n) = E_z max(0, r + b.n_xy + (1-r) n_z).
#pragma once

#include <format/reciprocal.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace dimmer {

inline constexpr float luminance_r = 0.2126f, luminance_g = 0.7152f, luminance_b = 0.0722f;
// A sunlit snow field to a moonless night, and then some: light over the exposure stays far from a float's limits.
inline constexpr int exposure_log2_max = 40;  // and no less than its negative

inline float luminance(float r, float g, float b) {
    return luminance_r * r + luminance_g * g + luminance_b * b;
}

// Unsigned float with 5 exponent bits and `mantissa_bits` (5 or 6), round to nearest even. NaN, negative and what is
// below 2^-14 give 0; too large gives the largest finite value. `exponent`: value * 2^exponent is what is encoded.
template <int mantissa_bits>
inline uint32_t encodeUfloat(float value, int exponent = 0) {
    constexpr int shift = 23 - mantissa_bits;
    constexpr uint32_t largest = (31u << mantissa_bits) - 1;
    const auto bias = static_cast<uint32_t>(112 - exponent) << mantissa_bits;
    if (!(value > 0)) return 0;
    const uint32_t bits = std::bit_cast<uint32_t>(value);
    const uint32_t rounded = (bits + ((1u << (shift - 1)) - 1) + (bits >> shift & 1)) >> shift;
    return rounded < bias + (1u << mantissa_bits) ? 0 : std::min(rounded - bias, largest);
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

// What the encoder never writes, replaced channel by channel: infinity and NaN by the largest finite code, codes below
// 2^-14 by 0. Executors see only such codes.
inline uint32_t canonicalR11G11B10(uint32_t code) {
    const auto channel = [code](int shift, uint32_t mantissa_bits, uint32_t all) {
        const uint32_t c = code >> shift & all, exponent = c >> mantissa_bits;
        return (exponent == 0 ? 0 : std::min(c, (31u << mantissa_bits) - 1)) << shift;
    };
    return channel(0, 6, 0x7ff) | channel(11, 6, 0x7ff) | channel(22, 5, 0x3ff);
}

inline constexpr float e5b9g9r9_largest = 65408;  // 511 * 2^7

// 2^(exponent field - 24): what one step of the mantissas is worth.
inline float stepE5B9G9R9(uint32_t code) {
    return std::bit_cast<float>(((code >> 27) + 103) << 23);
}

// NaN and negative give 0; too large gives the largest. `exponent`: value * 2^exponent is what is encoded.
inline uint32_t encodeE5B9G9R9(float r, float g, float b, int exponent = 0) {
    const float limit =
        std::bit_cast<float>(std::bit_cast<uint32_t>(e5b9g9r9_largest) - (static_cast<uint32_t>(exponent) << 23));
    const auto clamped = [limit](float v) { return v > 0 ? std::min(v, limit) : 0.0f; };
    const float cr = clamped(r), cg = clamped(g), cb = clamped(b);
    // Half a step of 9 bits up, so that a mantissa which rounds to 512 takes the next exponent.
    const uint32_t bits = std::bit_cast<uint32_t>(std::max(cr, std::max(cg, cb))) + (1u << 14);
    const auto lowest = static_cast<uint32_t>(111 - exponent);  // a float's exponent where the format's is 0
    const uint32_t field = std::max(bits >> 23, lowest);
    const float steps = std::bit_cast<float>((262 - field) << 23);  // 1 / step
    const auto code = [steps](float v) { return static_cast<uint32_t>(static_cast<int>(v * steps + 0.5f)); };
    return code(cr) | code(cg) << 9 | code(cb) << 18 | (field - lowest) << 27;
}

inline std::array<float, 3> decodeE5B9G9R9(uint32_t code) {
    const float step = stepE5B9G9R9(code);
    const auto channel = [step](uint32_t c) { return static_cast<float>(static_cast<int>(c & 0x1ffu)) * step; };
    return {channel(code), channel(code >> 9), channel(code >> 18)};
}

inline uint32_t encodeColor(ColorFormat format, float r, float g, float b) {
    return format == ColorFormat::R11G11B10F ? encodeR11G11B10(r, g, b) : encodeE5B9G9R9(r, g, b);
}
inline std::array<float, 3> decodeColor(ColorFormat format, uint32_t code) {
    return format == ColorFormat::R11G11B10F ? decodeR11G11B10(code) : decodeE5B9G9R9(code);
}
// The same numbers with the smallest step that holds them, as the encoder has it.
inline uint32_t canonicalE5B9G9R9(uint32_t code) {
    constexpr uint32_t exponent = 1u << 27, upper_halves = 1u << 8 | 1u << 17 | 1u << 26;
    while (code >= exponent && (code & upper_halves) == 0)
        code = (code & ~(31u << 27)) << 1 | ((code & 31u << 27) - exponent);
    return code;
}

// Executors see only what this returns. Every code of E5B9G9R9 is a finite number.
inline TexelRecord canonical(ColorFormat format, const TexelRecord& record) {
    return {
        format == ColorFormat::E5B9G9R9 ? canonicalE5B9G9R9(record.irradiance) : canonicalR11G11B10(record.irradiance),
        record.direction};
}

// The directional part of a texel: ambient share and the highlight's moment b (see above).
struct Highlight {
    float ambient = 1;
    float bx = 0, by = 0;
};

inline constexpr float moment_step = 5.0f / 256;  // 511 steps reach 9.98; |b| < sqrt(1 - 0.1^2) / 0.1 = 9.95
inline constexpr uint32_t moment_zero = 512;
inline constexpr uint32_t direction_none = 1023u | moment_zero << 10 | moment_zero << 20;

// `ambient`, `x`, `y`: as a sampler returns them, 0..1.
inline Highlight highlightFromUnorm(float ambient, float x, float y) {
    return {ambient, (x * 1023.0f - 512.0f) * moment_step, (y * 1023.0f - 512.0f) * moment_step};
}

inline Highlight decodeDirection(uint32_t code) {
    const auto moment = [](uint32_t c) { return static_cast<float>(static_cast<int>(c) - 512) * moment_step; };
    return {static_cast<float>(code & 0x3ff) / 1023.0f, moment(code >> 10 & 0x3ff), moment(code >> 20 & 0x3ff)};
}

// E(n) / E(+Z) as a model has it, for a unit normal in the texel's tangent space.
inline float falloff(DirectionModel model, const Highlight& h, const std::array<float, 3>& n) {
    const float highlight = h.bx * n[0] + h.by * n[1] + (1.0f - h.ambient) * n[2];
    return model == DirectionModel::Ahd ? h.ambient + std::max(0.0f, highlight) : std::max(0.0f, h.ambient + highlight);
}

// l E_z's luminance, `ambient` = l r, (bx, by) = l b.
inline uint32_t encodeDirection(float l, float ambient, float bx, float by) {
    if (!(l > 0)) return direction_none;
    const auto code = [](float value) { return static_cast<uint32_t>(std::clamp(value + 0.5f, 0.0f, 1023.0f)); };
    const float to_steps = 1.0f / (l * moment_step);
    return code(ambient / l * 1023.0f) | code(bx * to_steps + 512.0f) << 10 | code(by * to_steps + 512.0f) << 20;
}

inline constexpr int blend_exponent = 12;  // sums are 2^-12 of the value
// Records meet weights that carry this factor. For R11G11B10F it lifts a channel's bits, moved to a float's exponent as
// they stand (2^-126 and up), to its value times 2^-12, in one multiplication and for weights up to 2^28.
inline constexpr float weightScale(ColorFormat format) {
    return format == ColorFormat::R11G11B10F ? 0x1p100f : 0x1p-12f;
}
// Luminances of sums outside these have no direction (2^-20 and 2^40 of the value): black, or so bright that the
// products below could overflow, when irradiance has saturated long before.
inline constexpr float blend_luminance_min = 0x1p-32f, blend_luminance_max = 0x1p28f;

// Sums records with weights in 32-bit floats and encodes once. Order of the calls is part of the result.
template <ColorFormat format = ColorFormat::R11G11B10F>
struct TexelBlend {
    float r = 0, g = 0, b = 0;
    float l = 0;
    float d0 = 0, d1 = 0, d2 = 0;  // sums of l * code, the codes where they stand in the 32 bits

    // `record`: canonical; `wr`, `wg`, `wb`: weights times weightScale(format).
    void add(TexelRecord record, float wr, float wg, float wb) {
        const uint32_t d = record.direction;
        const auto lifted = lift(record.irradiance);
        const float cr = wr * lifted[0], cg = wg * lifted[1], cb = wb * lifted[2];
        const float cl = luminance(cr, cg, cb);
        r += cr;
        g += cg;
        b += cb;
        l += cl;
        d0 += cl * static_cast<float>(static_cast<int>(d & 0x3ffu));
        d1 += cl * static_cast<float>(static_cast<int>(d & 0xffc00u));
        d2 += cl * static_cast<float>(static_cast<int>(d & 0x3ff00000u));
    }
    TexelRecord encode() const { return {encodeLight(r, g, b), encodeMean()}; }

    // A canonical record's channels as weights meet them.
    static std::array<float, 3> lift(uint32_t code) {
        if constexpr (format == ColorFormat::E5B9G9R9) return decodeE5B9G9R9(code);
        return {std::bit_cast<float>((code & 0x7ffu) << 17), std::bit_cast<float>(code << 6 & 0xffe0000u),
                std::bit_cast<float>(code >> 4 & 0xffc0000u)};
    }
    static uint32_t encodeLight(float r, float g, float b) {
        if constexpr (format == ColorFormat::E5B9G9R9) return encodeE5B9G9R9(r, g, b, blend_exponent);
        return encodeUfloat<6>(r, blend_exponent) | encodeUfloat<6>(g, blend_exponent) << 11 |
               encodeUfloat<5>(b, blend_exponent) << 22;
    }

   private:
    uint32_t encodeMean() const {
        // Out of range the means may be NaN, which has no integer: they are replaced before they are used.
        const bool usable = l >= blend_luminance_min && l <= blend_luminance_max;
        const float inverse = reciprocal(usable ? l : 1.0f);
        const auto code = [&](float sum, float scale) {
            return static_cast<uint32_t>(static_cast<int>((usable ? sum : 0.0f) * (inverse * scale) + 0.5f));
        };
        const uint32_t mean = code(d0, 1) | code(d1, 0x1p-10f) << 10 | code(d2, 0x1p-20f) << 20;
        return usable ? mean : direction_none;
    }
};

}  // namespace dimmer
