// The 8-byte lightmap texel and its arithmetic: the GLSL twin, function by function, of runtime/format/texel.h, which
// says what the bytes mean. Everything is `precise`, so that devices with IEEE arithmetic agree bit for bit with C++.
#ifndef DIMMER_TEXEL_GLSL
#define DIMMER_TEXEL_GLSL

const float dimmer_highlight_z_min = 0.1;
const float dimmer_direction_luminance_min = 5.9604644775390625e-8;  // 2^-24
const float dimmer_direction_luminance_max = 1099511627776.0;        // 2^40
const uint dimmer_direction_none = 255u | 128u << 8 | 128u << 16;

float dimmer_luminance(float r, float g, float b) {
    precise float l = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    return l;
}

uint dimmer_encode_ufloat(float value, int mantissa_bits) {
    int shift = 23 - mantissa_bits;
    uint largest = (31u << mantissa_bits) - 1u;
    if (!(value > 0.0)) return 0u;
    if (value < 6.103515625e-5) {  // 2^-14: even steps below
        float magic = float(1 << (23 - 14 - mantissa_bits));
        precise float sum = value + magic;
        return floatBitsToUint(sum) - floatBitsToUint(magic);
    }
    uint bits = floatBitsToUint(value);
    uint rounded = bits + ((1u << (shift - 1)) - 1u) + (bits >> shift & 1u);
    return min((rounded >> shift) - (112u << mantissa_bits), largest);
}

float dimmer_decode_ufloat(uint code, int mantissa_bits) {
    uint mantissa_mask = (1u << mantissa_bits) - 1u;
    uint exponent = code >> mantissa_bits;
    precise float small = float(code) * (mantissa_bits == 6 ? 9.5367431640625e-7 : 1.9073486328125e-6);  // 2^-20, 2^-19
    return exponent == 0u
               ? small
               : uintBitsToFloat((exponent + 112u) << 23 | (code & mantissa_mask) << (23 - mantissa_bits));
}

uint dimmer_encode_r11g11b10(vec3 value) {
    return dimmer_encode_ufloat(value.r, 6) | dimmer_encode_ufloat(value.g, 6) << 11 |
           dimmer_encode_ufloat(value.b, 5) << 22;
}

vec3 dimmer_decode_r11g11b10(uint code) {
    return vec3(dimmer_decode_ufloat(code & 0x7ffu, 6), dimmer_decode_ufloat(code >> 11 & 0x7ffu, 6),
                dimmer_decode_ufloat(code >> 22, 5));
}

// x: the ambient share; yz: the highlight's moment b = (1-r) d_xy / d_z.
vec3 dimmer_highlight_from_bytes(float ambient, float mx, float my) {
    precise float share = 1.0 - ambient;
    if (!(share > 0.0)) return vec3(1.0, 0.0, 0.0);
    precise float m2 = mx * mx + my * my;
    precise float q_min = dimmer_highlight_z_min * share;
    precise float q2 = share * share - m2;
    precise float q2_min = q_min * q_min;
    precise float q = sqrt(max(q2, q2_min));
    precise float scale = share / q;
    precise vec3 highlight = vec3(ambient, mx * scale, my * scale);
    return highlight;
}

vec3 dimmer_decode_direction(uint code) {
    const float unorm = 1.0 / 255.0, snorm = 1.0 / 127.0;
    precise float ambient = float(code & 0xffu) * unorm;
    precise float mx = (float(code >> 8 & 0xffu) - 128.0) * snorm;
    precise float my = (float(code >> 16 & 0xffu) - 128.0) * snorm;
    return dimmer_highlight_from_bytes(ambient, mx, my);
}

uint dimmer_encode_direction(float l, float ambient, float bx, float by) {
    if (!(l >= dimmer_direction_luminance_min && l <= dimmer_direction_luminance_max)) return dimmer_direction_none;
    precise float rest = l - ambient;
    precise float share = max(rest, 0.0);
    precise float length2 = bx * bx + by * by + share * share;
    precise float len = sqrt(length2);
    if (!(len > 0.0)) return dimmer_direction_none;
    precise float len_l = len * l;
    precise float scale = share / len_l;
    precise float r = min(max(ambient / l, 0.0), 1.0);
    precise float mx = min(max(bx * scale, -1.0), 1.0);
    precise float my = min(max(by * scale, -1.0), 1.0);
    precise float r8 = r * 255.0 + 0.5;
    precise float x8 = mx * 127.0 + 128.5;
    precise float y8 = my * 127.0 + 128.5;
    return uint(r8) | uint(x8) << 8 | uint(y8) << 16;
}

// Sums records with weights and encodes once. Order of the calls is part of the result.
struct DimmerTexelBlend {
    vec3 irradiance;
    float l, ambient, bx, by;
};

DimmerTexelBlend dimmer_blend_add(DimmerTexelBlend sum, uvec2 record, vec3 weight) {
    precise vec3 e = weight * dimmer_decode_r11g11b10(record.x);
    vec3 h = dimmer_decode_direction(record.y);
    precise float l = dimmer_luminance(e.r, e.g, e.b);
    precise DimmerTexelBlend next;
    next.irradiance = sum.irradiance + e;
    next.l = sum.l + l;
    next.ambient = sum.ambient + l * h.x;
    next.bx = sum.bx + l * h.y;
    next.by = sum.by + l * h.z;
    return next;
}

uvec2 dimmer_blend_encode(DimmerTexelBlend sum) {
    return uvec2(dimmer_encode_r11g11b10(sum.irradiance),
                 dimmer_encode_direction(sum.l, sum.ambient, sum.bx, sum.by));
}

#endif
