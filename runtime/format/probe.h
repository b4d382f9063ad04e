// The 28-byte light probe and its arithmetic. GLSL twin: shaders/include/dimmer/probe.glsl.
//
//   light  the pack's ColorFormat: L_00 per channel, radiance * exposure
//   bands  24 signed bytes, coefficient by coefficient (l = 1: m -1..1, l = 2: m -2..2), channels r g b within each:
//          q_lm = 127 L_lm / (L_00 sqrt(2l + 1)), within [-127, 127] for any light that is nowhere negative
//
// Coefficients add linearly, and L_lm = L_00 sqrt(2l + 1) q / 127: the q of a sum is the mean of the parts' q, weighted
// with each channel's L_00. So blending multiplies by no sqrt(2l + 1) and takes no products of coefficients.
#pragma once

#include <format/texel.h>

#include <span>

namespace dimmer {

inline constexpr uint32_t probe_codes = 24, probe_words = 6;  // of the bands
inline constexpr size_t words_per_probe = 1 + probe_words;

// Sums records with weights in 32-bit floats and encodes once. Order of the calls is part of the result.
template <ColorFormat format>
struct ProbeBlend {
    std::array<float, 3> light{};
    std::array<float, probe_codes> bands{};  // sums of light * (code + 128)

    // The weight carries weightScale(format).
    void add(const ProbeRecord& record, float wr, float wg, float wb) {
        const TexelRecord dc = canonical(format, {record.light, 0});
        const auto lifted = TexelBlend<format>::lift(dc.irradiance);
        const std::array<float, 3> part = {wr * lifted[0], wg * lifted[1], wb * lifted[2]};
        for (size_t c = 0; c < 3; ++c) light[c] += part[c];
        // In arrays of 24, which compilers take as three vectors of eight.
        std::array<float, probe_codes> parts;
        for (size_t i = 0; i < probe_codes; ++i) parts[i] = part[i % 3];
        const auto codes = std::bit_cast<std::array<uint8_t, probe_codes>>(record.bands);
        for (size_t i = 0; i < probe_codes; ++i) bands[i] += parts[i] * static_cast<float>(codes[i] ^ 0x80);
    }

    ProbeRecord encode() const {
        std::array<float, probe_codes> inverse;
        std::array<uint32_t, probe_codes> usable;  // all bits, or none where there is no light to divide by
        for (size_t i = 0; i < probe_codes; ++i) {
            const float l = light[i % 3];
            const bool in_range = l >= blend_luminance_min && l <= blend_luminance_max;
            usable[i] = in_range ? ~0u : 0u;
            inverse[i] = reciprocal(in_range ? l : 1.0f);
        }
        std::array<uint8_t, probe_codes> codes;
        for (size_t i = 0; i < probe_codes; ++i) {
            // What is not usable may be NaN, which has no integer: its bits are gone before it is used.
            const float sum = std::bit_cast<float>(std::bit_cast<uint32_t>(bands[i]) & usable[i]);
            const auto mean = static_cast<uint32_t>(static_cast<int>(sum * inverse[i] + 0.5f));
            codes[i] = static_cast<uint8_t>(((mean & usable[i]) | (128u & ~usable[i])) ^ 0x80u);
        }
        return {TexelBlend<format>::encodeLight(light[0], light[1], light[2]),
                std::bit_cast<std::array<uint32_t, probe_words>>(codes)};
    }
};

// What executors see of a record: no infinities, no NaN.
inline ProbeRecord canonicalProbe(ColorFormat format, const ProbeRecord& record) {
    return {canonical(format, {record.light, 0}).irradiance, record.bands};
}

// Of blended probes, words_per_probe each.
inline ProbeRecord probeAt(std::span<const uint32_t> words, uint32_t number) {
    const uint32_t* w = &words[words_per_probe * number];
    return {w[0], {w[1], w[2], w[3], w[4], w[5], w[6]}};
}

}  // namespace dimmer
