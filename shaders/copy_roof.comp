// The roof for updates: loads and stores as many bytes as they do, and computes nothing. See tools/copy_roof.h.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "table.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const int loads = 3;        // of 16 bytes, per 16 bytes stored
layout(constant_id = 2) const int lane_stores = 4;  // 16 bytes that a lane stores, one after another
layout(constant_id = 3) const bool to_pages = false;
layout(constant_id = 4) const bool one_stream = false;  // a unit's loads lie side by side, not in streams of their own

layout(push_constant) uniform Copy {
    uint first, count;  // units of 16 bytes to store
    uint stride;        // from one stream of loads to the next
    uint page_width;
}
copy;

TABLE(0, uvec4, source)
layout(set = 0, binding = 1, std430) writeonly buffer Target { uvec4 target[]; };
layout(set = 0, binding = 2, r32ui) writeonly uniform uimage2DArray pages_0;
layout(set = 0, binding = 3, r32ui) writeonly uniform uimage2DArray pages_1;

void store(uint unit, uvec4 value) {
    if (to_pages) {
        ivec3 texel = ivec3(unit * 2u % copy.page_width, unit * 2u / copy.page_width, 0);
        imageStore(pages_0, texel, uvec4(value.x));
        imageStore(pages_1, texel, uvec4(value.y));
        texel.x += 1;
        imageStore(pages_0, texel, uvec4(value.z));
        imageStore(pages_1, texel, uvec4(value.w));
    } else {
        target[unit] = value;
    }
}

void main() {
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    // Eight neighbouring lanes side by side, as in blend_texels.comp.
    uint lane = gl_LocalInvocationIndex;
    uint begin = (group * gl_WorkGroupSize.x + lane / 8u * 8u) * uint(lane_stores) + lane % 8u;
    for (int i = 0; i < lane_stores; ++i) {
        uint unit = begin + uint(i) * 8u;
        if (unit >= copy.count) return;
        uvec4 value = uvec4(0);
        uint begin_load = one_stream ? (copy.first + unit) * uint(loads) : copy.first + unit;
        uint step = one_stream ? 1u : copy.stride;
        for (int s = 0; s < loads; ++s) value ^= FETCH(source, begin_load + uint(s) * step);
        store(copy.first + unit, value);
    }
}
