// Blends batches of lightmap texels: one workgroup per batch, one lane per receiver, each texel written once. The CPU
// twin is blendTexel in runtime/cpu/cpu_runtime.cpp.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "dimmer/texel.glsl"
#include "dimmer/work_list.glsl"

layout(local_size_x = 64) in;

// Contributions that are on in every batch of this dispatch; -1: each batch has its own number.
layout(constant_id = 0) const int terms_on = -1;

layout(push_constant) uniform Dispatch {
    uint first_item;
    uint item_count;
}
dispatch;

layout(set = 0, binding = 0, std430) readonly buffer Addresses { uint addresses[]; };
layout(set = 0, binding = 1, std430) readonly buffer Base { uvec2 base[]; };
layout(set = 0, binding = 2, std430) readonly buffer Payload { uvec2 payload[]; };
layout(set = 0, binding = 3, std430) readonly buffer Items { WorkItem items[]; };
layout(set = 0, binding = 4, std430) readonly buffer Terms { WorkTerm terms[]; };
layout(set = 0, binding = 5, r32ui) writeonly uniform uimage2DArray irradiance_pages;
layout(set = 0, binding = 6, r32ui) writeonly uniform uimage2DArray direction_pages;

uvec2 blend_texel(uint receiver, WorkItem item) {
    uvec2 base_record = base[receiver];
    int count = terms_on < 0 ? int(item.term_count) : terms_on;
    if (count == 0) return base_record;
    DimmerTexelBlend sum = DimmerTexelBlend(vec3(0), 0.0, 0.0, 0.0, 0.0);
    sum = dimmer_blend_add(sum, base_record, vec3(1));
    for (int i = 0; i < count; ++i) {
        WorkTerm term = terms[item.first_term + i];
        sum = dimmer_blend_add(sum, payload[term.payload_bias + receiver],
                               vec3(term.weight_r, term.weight_g, term.weight_b));
    }
    return dimmer_blend_encode(sum);
}

void main() {
    // The grid is 2D only because one side of it is limited.
    uint index = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (index >= dispatch.item_count) return;
    WorkItem item = items[dispatch.first_item + index];
    uint lane = gl_LocalInvocationIndex;
    if (lane >= item.receiver_count) return;

    uint receiver = item.first_receiver + lane;
    uint address = addresses[receiver];
    ivec3 texel = ivec3(address & 0xfffu, address >> 12 & 0xfffu, address >> 24);  // TexelAddress
    uvec2 record = blend_texel(receiver, item);
    imageStore(irradiance_pages, texel, uvec4(record.x));
    imageStore(direction_pages, texel, uvec4(record.y));
}
