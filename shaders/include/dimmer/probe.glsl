// The 28-byte light probe's blending: the GLSL twin of runtime/format/probe.h, which says what the bytes mean.
#ifndef DIMMER_PROBE_GLSL
#define DIMMER_PROBE_GLSL

#include "dimmer/texel.glsl"

const int dimmer_probe_triples = 8;  // coefficients of bands 1 and 2, three channels each

struct DimmerProbe {
    uint light;
    uint bands[6];
};

struct DimmerProbeBlend {
    vec3 light;
    vec3 bands[dimmer_probe_triples];
};

DimmerProbeBlend dimmer_probe_none() {
    DimmerProbeBlend sum;
    sum.light = vec3(0);
    for (int i = 0; i < dimmer_probe_triples; ++i) sum.bands[i] = vec3(0);
    return sum;
}

float dimmer_probe_code(DimmerProbe probe, int i) {
    return float(int((probe.bands[i >> 2] >> (8 * (i & 3)) & 0xffu) ^ 0x80u));
}

// `weight` carries dimmer_weight_scale.
void dimmer_probe_add(inout DimmerProbeBlend sum, DimmerProbe probe, vec3 weight, uint format) {
    precise vec3 part = weight * dimmer_lift(probe.light, format);
    precise vec3 light = sum.light + part;
    sum.light = light;
    for (int i = 0; i < dimmer_probe_triples; ++i) {
        precise vec3 codes = part * vec3(dimmer_probe_code(probe, 3 * i), dimmer_probe_code(probe, 3 * i + 1),
                                         dimmer_probe_code(probe, 3 * i + 2));
        precise vec3 bands = sum.bands[i] + codes;
        sum.bands[i] = bands;
    }
}

DimmerProbe dimmer_probe_encode(DimmerProbeBlend sum, uint format) {
    DimmerProbe probe;
    probe.light = dimmer_encode_light(sum.light, format);
    bvec3 usable = bvec3(uvec3(greaterThanEqual(sum.light, vec3(dimmer_blend_luminance_min))) &
                         uvec3(lessThanEqual(sum.light, vec3(dimmer_blend_luminance_max))));
    vec3 inverse = dimmer_reciprocal(mix(vec3(1), sum.light, usable));
    for (int i = 0; i < 6; ++i) probe.bands[i] = 0u;
    for (int i = 0; i < dimmer_probe_triples; ++i) {
        precise vec3 means = mix(vec3(0), sum.bands[i], usable) * inverse + 0.5;
        uvec3 codes = mix(uvec3(128), uvec3(ivec3(means)), usable) ^ 0x80u;
        for (int c = 0; c < 3; ++c) {
            int place = 3 * i + c;
            probe.bands[place >> 2] |= codes[c] << (8 * (place & 3));
        }
    }
    return probe;
}

#endif
