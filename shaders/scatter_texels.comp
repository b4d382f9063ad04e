// The naive scatter that UBERBAKE's section 3.3 names second, to compare against: sets are added one after another to a
// scratch buffer of 32-bit sums, which is encoded at the end. Exact only when it starts afresh, so everything that is
// on is added again whenever anything changed.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "dimmer/texel.glsl"
#include "table.glsl"

layout(local_size_x = 64) in;

// 0: sums start with the base; 1: one contribution is added; 2: pages are written.
layout(constant_id = 0) const int pass = 0;

layout(constant_id = 1) const uint color_format = 0u;  // ColorFormat

layout(push_constant) uniform Dispatch {
    uint count;         // receivers, or records of the contribution
    uint first_record;  // of the contribution
    float weight_r, weight_g, weight_b;
}
dispatch;

struct Scratch {
    float r, g, b, l, d0, d1, d2, terms;
};

TABLE(0, uint, addresses)  // TexelAddress
TABLE(1, uvec2, base)
TABLE(2, uvec2, payload)
TABLE(3, uint, receivers)  // of each record
layout(set = 0, binding = 4, std430) buffer Sums { Scratch sums[]; };
layout(set = 0, binding = 5, r32ui) writeonly uniform uimage2DArray irradiance_pages;
layout(set = 0, binding = 6, r32ui) writeonly uniform uimage2DArray direction_pages;

DimmerTexelBlend load(uint receiver) {
    Scratch s = sums[receiver];
    return DimmerTexelBlend(vec3(s.r, s.g, s.b), s.l, vec3(s.d0, s.d1, s.d2));
}

void save(uint receiver, DimmerTexelBlend sum, float terms) {
    sums[receiver] = Scratch(sum.irradiance.r, sum.irradiance.g, sum.irradiance.b, sum.l, sum.direction.x,
                             sum.direction.y, sum.direction.z, terms);
}

void main() {
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
    if (index >= dispatch.count) return;
    if (pass == 0) {
        uvec2 record = FETCH(base, index).xy;
        DimmerTexelBlend sum = DimmerTexelBlend(vec3(0), 0.0, vec3(0));
        dimmer_blend_add(sum, record.x, record.y, vec3(dimmer_weight_scale(color_format)), color_format);
        save(index, sum, 0.0);
    } else if (pass == 1) {
        uint record_index = dispatch.first_record + index;
        uint receiver = FETCH(receivers, record_index).x;
        uvec2 record = FETCH(payload, record_index).xy;
        DimmerTexelBlend sum = load(receiver);
        dimmer_blend_add(sum, record.x, record.y, vec3(dispatch.weight_r, dispatch.weight_g, dispatch.weight_b), color_format);
        save(receiver, sum, 1.0);
    } else {
        uvec2 record = sums[index].terms > 0.0 ? dimmer_blend_encode(load(index), color_format) : FETCH(base, index).xy;
        uint address = FETCH(addresses, index).x;
        ivec3 texel = ivec3(address & 0xfffu, address >> 12 & 0xfffu, address >> 24);
        imageStore(irradiance_pages, texel, uvec4(record.x));
        imageStore(direction_pages, texel, uvec4(record.y));
    }
}
