// Takes the probes of moving models from the global grid (see ResampleItem), a lane per probe, a workgroup per item.
// The CPU twin is resampleItem in runtime/probes/resample.cpp.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "table.glsl"

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint color_format = 0u;  // ColorFormat

layout(push_constant) uniform Dispatch {
    uint item_count;
    uint first_moving;  // probe; hints[0] is its
}
dispatch;

TABLE(0, uvec4, items)  // ResampleItem, four elements each
layout(set = 0, binding = 1, std430) readonly buffer Grid { uvec4 grid_table[]; };
layout(set = 0, binding = 2, std430) buffer Probes { uint probes[]; };
layout(set = 0, binding = 3, std430) buffer Hints { uint hints[]; };  // per moving probe

#define DIMMER_PROBE_WORD(i) probes[i]
#define DIMMER_GRID_WORDS(i) grid_table[i]
#include "dimmer/grid.glsl"

DimmerProbe resample(vec3 point, inout uint tetrahedron) {
    DimmerGridPlace place = dimmer_locate(point, tetrahedron);
    tetrahedron = place.tetrahedron;
    vec4 weights = dimmer_probe_weights(place);
    uvec4 numbers = dimmer_tetrahedron_part(place.tetrahedron, 0u);
    DimmerProbeBlend sum = dimmer_probe_none();
    for (int i = 0; i < 4; ++i) {
        precise float weight = weights[i] * dimmer_weight_scale(color_format);
        dimmer_probe_add(sum, dimmer_probe_load(numbers[i]), vec3(weight), color_format);
    }
    return dimmer_probe_encode(sum, color_format);
}

void main() {
    uint index = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (index >= dispatch.item_count) return;
    uvec4 origin = FETCH(items, 4u * index), step_x = FETCH(items, 4u * index + 1u);
    uvec4 step_y = FETCH(items, 4u * index + 2u), step_z = FETCH(items, 4u * index + 3u);
    if (gl_LocalInvocationIndex >= step_z.w) return;
    uint i = step_y.w + gl_LocalInvocationIndex;
    uvec3 counts = uvec3(step_x.w & 0xffu, step_x.w >> 8 & 0xffu, step_x.w >> 16);
    vec3 cell = vec3(i % counts.x, i / counts.x % counts.y, i / (counts.x * counts.y));
    precise vec3 along_x = uintBitsToFloat(origin.xyz) + cell.x * uintBitsToFloat(step_x.xyz);
    precise vec3 along_y = along_x + cell.y * uintBitsToFloat(step_y.xyz);
    precise vec3 point = along_y + cell.z * uintBitsToFloat(step_z.xyz);

    uint number = origin.w + i;
    uint hint = hints[number - dispatch.first_moving];
    DimmerProbe probe = resample(point, hint);
    hints[number - dispatch.first_moving] = hint;
    probes[number * 7u] = probe.light;
    for (int word = 0; word < 6; ++word) probes[number * 7u + 1u + uint(word)] = probe.bands[word];
}
