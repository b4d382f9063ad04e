// The 8-byte lightmap texel and its arithmetic: the GLSL twin, function by function, of runtime/format/texel.h, which
// says what the bytes mean. Everything is `precise`, so that devices with IEEE arithmetic agree bit for bit with C++.
#ifndef DIMMER_TEXEL_GLSL
#define DIMMER_TEXEL_GLSL

const float dimmer_moment_step = 5.0 / 256.0;
const uint dimmer_direction_none = 1023u | 512u << 10 | 512u << 20;
const float dimmer_weight_scale = 1267650600228229401496703205376.0;  // 2^100
const int dimmer_blend_exponent = 12;
const float dimmer_blend_luminance_min = 2.3283064365386962890625e-10;  // 2^-32
const float dimmer_blend_luminance_max = 268435456.0;                   // 2^28

float dimmer_luminance(float r, float g, float b) {
    precise float l = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    return l;
}

// `value` is not negative and no NaN.
uint dimmer_encode_ufloat(float value, int mantissa_bits, int exponent) {
    int shift = 23 - mantissa_bits;
    uint largest = (31u << mantissa_bits) - 1u;
    uint bias = uint(112 - exponent) << mantissa_bits;
    uint bits = floatBitsToUint(value);
    uint rounded = (bits + ((1u << (shift - 1)) - 1u) + (bits >> shift & 1u)) >> shift;
    return rounded < bias + (1u << mantissa_bits) ? 0u : min(rounded - bias, largest);
}

// x: the ambient share; yz: the highlight's moment b = (1-r) d_xy / d_z. `codes`: as a sampler returns them.
vec3 dimmer_highlight_from_unorm(vec3 codes) {
    return vec3(codes.x, (codes.yz * 1023.0 - 512.0) * dimmer_moment_step);
}

// Sums records with weights and encodes once. Order of the calls is part of the result.
struct DimmerTexelBlend {
    vec3 irradiance;
    float l;
    vec3 direction;
};

// `weight` carries dimmer_weight_scale.
void dimmer_blend_add(inout DimmerTexelBlend sum, uint irradiance, uint direction, vec3 weight) {
    precise vec3 e = weight * uintBitsToFloat(uvec3((irradiance & 0x7ffu) << 17, irradiance << 6 & 0xffe0000u,
                                                    irradiance >> 4 & 0xffc0000u));
    precise float l = dimmer_luminance(e.r, e.g, e.b);
    precise vec3 codes = l * vec3(ivec3(direction & 0x3ffu, direction & 0xffc00u, direction & 0x3ff00000u));
    precise vec3 irradiance_sum = sum.irradiance + e;
    precise float l_sum = sum.l + l;
    precise vec3 direction_sum = sum.direction + codes;
    sum = DimmerTexelBlend(irradiance_sum, l_sum, direction_sum);
}

uvec2 dimmer_blend_encode(DimmerTexelBlend sum) {
    uint irradiance = dimmer_encode_ufloat(sum.irradiance.r, 6, dimmer_blend_exponent) |
                      dimmer_encode_ufloat(sum.irradiance.g, 6, dimmer_blend_exponent) << 11 |
                      dimmer_encode_ufloat(sum.irradiance.b, 5, dimmer_blend_exponent) << 22;
    // Out of range the means may be NaN, which has no integer: they are replaced before they are used.
    bool usable = sum.l >= dimmer_blend_luminance_min && sum.l <= dimmer_blend_luminance_max;
    precise float inverse = 1.0 / (usable ? sum.l : 1.0);
    precise vec3 scale = inverse * vec3(1.0, 1.0 / 1024.0, 1.0 / 1048576.0);
    precise vec3 means = (usable ? sum.direction : vec3(0)) * scale + 0.5;
    ivec3 codes = ivec3(means);
    uint direction = uint(codes.x) | uint(codes.y) << 10 | uint(codes.z) << 20;
    return uvec2(irradiance, usable ? direction : dimmer_direction_none);
}

#endif
