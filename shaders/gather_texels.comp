// The naive gather that UBERBAKE's section 3.3 begins with, to compare against: each receiver has a list of its own, of
// records and of the contributions they belong to. Every receiver runs whenever anything changed.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "dimmer/texel.glsl"
#include "table.glsl"

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint color_format = 0u;  // ColorFormat

layout(push_constant) uniform Dispatch {
    uint receivers;
}
dispatch;

TABLE(0, uint, addresses)      // TexelAddress
TABLE(1, uvec2, base)
TABLE(2, uvec2, payload)       // receiver by receiver
TABLE(3, uint, contributions)  // of each record
TABLE(4, uint, first_record)   // per receiver, and one more
TABLE(5, uvec4, weights)       // per contribution, as a WorkTerm: whether it is on, weight
layout(set = 0, binding = 6, r32ui) writeonly uniform uimage2DArray irradiance_pages;
layout(set = 0, binding = 7, r32ui) writeonly uniform uimage2DArray direction_pages;

void main() {
    uint receiver = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
    if (receiver >= dispatch.receivers) return;
    uvec2 record = FETCH(base, receiver).xy;
    DimmerTexelBlend sum = DimmerTexelBlend(vec3(0), 0.0, vec3(0));
    dimmer_blend_add(sum, record.x, record.y, vec3(dimmer_weight_scale(color_format)), color_format);
    bool any = false;
    uint end = FETCH(first_record, receiver + 1u).x;
    for (uint i = FETCH(first_record, receiver).x; i < end; ++i) {
        uvec4 term = FETCH(weights, FETCH_HALF(contributions, i));
        if (term.x == 0u) continue;
        any = true;
        uvec2 added = FETCH(payload, i).xy;
        dimmer_blend_add(sum, added.x, added.y, uintBitsToFloat(term.yzw), color_format);
    }
    if (any) record = dimmer_blend_encode(sum, color_format);
    uint address = FETCH(addresses, receiver).x;
    ivec3 texel = ivec3(address & 0xfffu, address >> 12 & 0xfffu, address >> 24);
    imageStore(irradiance_pages, texel, uvec4(record.x));
    imageStore(direction_pages, texel, uvec4(record.y));
}
