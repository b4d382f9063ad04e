// The 8-byte lightmap texel and its arithmetic: the GLSL twin, function by function, of runtime/format/texel.h, which
// says what the bytes mean. Everything is `precise` and nothing is divided, so that devices agree bit for bit with C++.
#ifndef DIMMER_TEXEL_GLSL
#define DIMMER_TEXEL_GLSL

const float dimmer_moment_step = 5.0 / 256.0;
const uint dimmer_direction_none = 1023u | 512u << 10 | 512u << 20;
const uint dimmer_r11g11b10f = 0u;  // ColorFormat
const uint dimmer_e5b9g9r9 = 1u;
const int dimmer_blend_exponent = 12;
const float dimmer_blend_luminance_min = 2.3283064365386962890625e-10;  // 2^-32
const float dimmer_blend_luminance_max = 268435456.0;                   // 2^28

// 1 / x to 1e-7, the same on every device: Vulkan's divisions are not. See runtime/format/reciprocal.h.
vec3 dimmer_reciprocal(vec3 x) {
    precise vec3 y = uintBitsToFloat(0x7ef311c3u - floatBitsToUint(x));
    for (int i = 0; i < 2; ++i) y = y * (2.0 - x * y);
    y = y + y * (1.0 - x * y);
    return y;
}

float dimmer_reciprocal(float x) {
    precise float y = uintBitsToFloat(0x7ef311c3u - floatBitsToUint(x));
    for (int i = 0; i < 2; ++i) y = y * (2.0 - x * y);
    y = y + y * (1.0 - x * y);
    return y;
}

float dimmer_luminance(float r, float g, float b) {
    precise float l = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    return l;
}

// What weights carry; `format` is a ColorFormat, here and below: a constant, as a specialisation constant is.
float dimmer_weight_scale(uint format) {
    return format == dimmer_r11g11b10f ? 1267650600228229401496703205376.0 : 0.000244140625;  // 2^100, 2^-12
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

// `value` is not negative and no NaN.
uint dimmer_encode_e5b9g9r9(vec3 value, int exponent) {
    vec3 clamped = min(value, vec3(uintBitsToFloat(0x477f8000u - (uint(exponent) << 23))));  // 65408
    uint bits = floatBitsToUint(max(clamped.r, max(clamped.g, clamped.b))) + (1u << 14);
    uint lowest = uint(111 - exponent);
    uint field = max(bits >> 23, lowest);
    precise vec3 steps = clamped * uintBitsToFloat((262u - field) << 23) + 0.5;
    uvec3 codes = uvec3(ivec3(steps));
    return codes.r | codes.g << 9 | codes.b << 18 | (field - lowest) << 27;
}

// A record's channels as weights meet them: their bits in a float's exponent, or their values.
vec3 dimmer_lift(uint code, uint format) {
    if (format == dimmer_r11g11b10f)
        return uintBitsToFloat(uvec3((code & 0x7ffu) << 17, code << 6 & 0xffe0000u, code >> 4 & 0xffc0000u));
    float exponent_step = uintBitsToFloat(((code >> 27) + 103u) << 23);
    precise vec3 light = vec3(ivec3(code & 0x1ffu, code >> 9 & 0x1ffu, code >> 18 & 0x1ffu)) * exponent_step;
    return light;
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
void dimmer_blend_add(inout DimmerTexelBlend sum, uint irradiance, uint direction, vec3 weight, uint format) {
    precise vec3 e = weight * dimmer_lift(irradiance, format);
    precise float l = dimmer_luminance(e.r, e.g, e.b);
    precise vec3 codes = l * vec3(ivec3(direction & 0x3ffu, direction & 0xffc00u, direction & 0x3ff00000u));
    precise vec3 irradiance_sum = sum.irradiance + e;
    precise float l_sum = sum.l + l;
    precise vec3 direction_sum = sum.direction + codes;
    sum = DimmerTexelBlend(irradiance_sum, l_sum, direction_sum);
}

// `light`: a sum of lifted channels times weights.
uint dimmer_encode_light(vec3 light, uint format) {
    if (format != dimmer_r11g11b10f) return dimmer_encode_e5b9g9r9(light, dimmer_blend_exponent);
    return dimmer_encode_ufloat(light.r, 6, dimmer_blend_exponent) |
           dimmer_encode_ufloat(light.g, 6, dimmer_blend_exponent) << 11 |
           dimmer_encode_ufloat(light.b, 5, dimmer_blend_exponent) << 22;
}

uvec2 dimmer_blend_encode(DimmerTexelBlend sum, uint format) {
    uint irradiance = dimmer_encode_light(sum.irradiance, format);
    // Out of range the means may be NaN, which has no integer: they are replaced before they are used.
    bool usable = sum.l >= dimmer_blend_luminance_min && sum.l <= dimmer_blend_luminance_max;
    float inverse = dimmer_reciprocal(usable ? sum.l : 1.0);
    precise vec3 scale = inverse * vec3(1.0, 1.0 / 1024.0, 1.0 / 1048576.0);
    precise vec3 means = (usable ? sum.direction : vec3(0)) * scale + 0.5;
    ivec3 codes = ivec3(means);
    uint direction = uint(codes.x) | uint(codes.y) << 10 | uint(codes.z) << 20;
    return uvec2(irradiance, usable ? direction : dimmer_direction_none);
}

#endif
