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

namespace dimmer {

inline constexpr uint32_t probe_codes = 24, probe_words = 6;

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
        for (size_t i = 0; i < probe_codes; ++i) bands[i] += part[i % 3] * offsetCode(record, i);
    }

    ProbeRecord encode() const {
        ProbeRecord record{.light = TexelBlend<format>::encodeLight(light[0], light[1], light[2]), .bands = {}};
        std::array<bool, 3> usable;
        std::array<float, 3> inverse;
        for (size_t c = 0; c < 3; ++c) {
            usable[c] = light[c] >= blend_luminance_min && light[c] <= blend_luminance_max;
            inverse[c] = 1.0f / (usable[c] ? light[c] : 1.0f);
        }
        for (size_t i = 0; i < probe_codes; ++i) {
            const size_t c = i % 3;
            const auto mean =
                static_cast<uint32_t>(static_cast<int>((usable[c] ? bands[i] : 0.0f) * inverse[c] + 0.5f));
            const uint32_t code = usable[c] ? mean : 128u;
            record.bands[i / 4] |= (code ^ 0x80u) << (8 * (i % 4));
        }
        return record;
    }

   private:
    // A signed byte plus 128: an unsigned number without a conditional.
    static float offsetCode(const ProbeRecord& record, size_t i) {
        return static_cast<float>(static_cast<int>((record.bands[i / 4] >> (8 * (i % 4)) & 0xffu) ^ 0x80u));
    }
};

// What executors see of a record: no infinities, no NaN.
inline ProbeRecord canonicalProbe(ColorFormat format, const ProbeRecord& record) {
    return {canonical(format, {record.light, 0}).irradiance, record.bands};
}

}  // namespace dimmer
