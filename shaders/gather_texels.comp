// The naive gather that UBERBAKE's section 3.3 begins with, to compare against: each receiver has a list of its own, of
// records and of the contributions they belong to. Every receiver runs whenever anything changed.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "dimmer/texel.glsl"

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint color_format = 0u;  // ColorFormat

layout(push_constant) uniform Dispatch {
    uint receivers;
}
dispatch;

layout(set = 0, binding = 0) uniform utextureBuffer addresses;  // TexelAddress
layout(set = 0, binding = 1) uniform utextureBuffer base;
layout(set = 0, binding = 2) uniform utextureBuffer payload;        // receiver by receiver
layout(set = 0, binding = 3) uniform utextureBuffer contributions;  // of each record
layout(set = 0, binding = 4) uniform utextureBuffer first_record;   // per receiver, and one more
layout(set = 0, binding = 5) uniform utextureBuffer weights;        // per contribution, as a WorkTerm: whether it is on, weight
layout(set = 0, binding = 6, r32ui) writeonly uniform uimage2DArray irradiance_pages;
layout(set = 0, binding = 7, r32ui) writeonly uniform uimage2DArray direction_pages;

void main() {
    uint receiver = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
    if (receiver >= dispatch.receivers) return;
    uvec2 record = texelFetch(base, int(receiver)).xy;
    DimmerTexelBlend sum = DimmerTexelBlend(vec3(0), 0.0, vec3(0));
    dimmer_blend_add(sum, record.x, record.y, vec3(dimmer_weight_scale(color_format)), color_format);
    bool any = false;
    uint end = texelFetch(first_record, int(receiver) + 1).x;
    for (uint i = texelFetch(first_record, int(receiver)).x; i < end; ++i) {
        uvec4 term = texelFetch(weights, int(texelFetch(contributions, int(i)).x));
        if (term.x == 0u) continue;
        any = true;
        uvec2 added = texelFetch(payload, int(i)).xy;
        dimmer_blend_add(sum, added.x, added.y, uintBitsToFloat(term.yzw), color_format);
    }
    if (any) record = dimmer_blend_encode(sum, color_format);
    uint address = texelFetch(addresses, int(receiver)).x;
    ivec3 texel = ivec3(address & 0xfffu, address >> 12 & 0xfffu, address >> 24);
    imageStore(irradiance_pages, texel, uvec4(record.x));
    imageStore(direction_pages, texel, uvec4(record.y));
}
