#include <cpu/batch_blend.h>

namespace dimmer {
namespace {

// As encodeUfloat, without a branch: sums of light are never negative, and a NaN is no more than a large code.
template <int mantissa_bits>
uint32_t encodeSum(float sum) {
    constexpr uint32_t shift = 23 - mantissa_bits, largest = (31u << mantissa_bits) - 1;
    constexpr uint32_t bias = static_cast<uint32_t>(112 - blend_exponent) << mantissa_bits;
    const uint32_t bits = std::bit_cast<uint32_t>(sum);
    const uint32_t rounded = (bits + ((1u << (shift - 1)) - 1) + (bits >> shift & 1)) >> shift;
    const uint32_t code = std::min(rounded - bias, largest);
    return rounded < bias + (1u << mantissa_bits) ? 0 : code;
}

// A channel as canonicalR11G11B10 leaves it, moved to where a float has its exponent.
template <int position, uint32_t mantissa_bits, uint32_t all>
float liftedChannel(uint32_t code) {
    const uint32_t c = code >> position & all;
    const uint32_t bounded = std::min(c, (31u << mantissa_bits) - 1);
    return std::bit_cast<float>((c < (1u << mantissa_bits) ? 0 : bounded) << (23 - mantissa_bits));
}

float asFloat(uint32_t code) {
    return static_cast<float>(static_cast<int32_t>(code));
}

template <ColorFormat format>
std::array<float, 3> lifted(uint32_t code) {
    if constexpr (format == ColorFormat::E5B9G9R9) return decodeE5B9G9R9(code);
    return {liftedChannel<0, 6, 0x7ff>(code), liftedChannel<11, 6, 0x7ff>(code), liftedChannel<22, 5, 0x3ff>(code)};
}

template <ColorFormat format>
uint32_t encodeLight(float r, float g, float b) {
    if constexpr (format == ColorFormat::E5B9G9R9) return encodeE5B9G9R9(r, g, b, blend_exponent);
    return encodeSum<6>(r) | encodeSum<6>(g) << 11 | encodeSum<5>(b) << 22;
}

}  // namespace

template <ColorFormat format>
void BatchBlend<format>::add(const TexelRecord* records, float wr, float wg, float wb) {
    for (uint32_t i = 0; i < count_; ++i) {
        const auto light = lifted<format>(records[i].irradiance);
        const uint32_t d = records[i].direction;
        const float cr = wr * light[0], cg = wg * light[1], cb = wb * light[2];
        const float cl = luminance(cr, cg, cb);
        r_[i] += cr;
        g_[i] += cg;
        b_[i] += cb;
        l_[i] += cl;
        d0_[i] += cl * asFloat(d & 0x3ffu);
        d1_[i] += cl * asFloat(d & 0xffc00u);
        d2_[i] += cl * asFloat(d & 0x3ff00000u);
    }
}

template <ColorFormat format>
void BatchBlend<format>::encode(TexelRecord* records) const {
    for (uint32_t i = 0; i < count_; ++i) {
        const bool usable = (l_[i] >= blend_luminance_min) & (l_[i] <= blend_luminance_max);
        const float inverse = reciprocal(usable ? l_[i] : 1.0f);
        const auto code = [&](float sum, float scale) {
            return static_cast<uint32_t>(static_cast<int32_t>((usable ? sum : 0.0f) * (inverse * scale) + 0.5f));
        };
        const uint32_t mean = code(d0_[i], 1) | code(d1_[i], 0x1p-10f) << 10 | code(d2_[i], 0x1p-20f) << 20;
        records[i].irradiance = encodeLight<format>(r_[i], g_[i], b_[i]);
        records[i].direction = usable ? mean : direction_none;
    }
}

template class BatchBlend<ColorFormat::R11G11B10F>;
template class BatchBlend<ColorFormat::E5B9G9R9>;

}  // namespace dimmer
