// Blends work items of light probes (see dimmer/work_list.glsl), a lane per probe, each probe written once. Records lie
// in three streams of 16, 8 and 4 bytes, so that each part of one is a single aligned load.
// The CPU twin is blendProbes in runtime/cpu/cpu_runtime.cpp.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "dimmer/probe.glsl"
#include "table.glsl"

layout(local_size_x_id = 1) in;

// The most contributions that are on in an item of this dispatch; -1: no limit.
layout(constant_id = 0) const int terms_on = -1;
layout(constant_id = 2) const uint color_format = 0u;  // ColorFormat

layout(push_constant) uniform Dispatch {
    uint first_item;
    uint item_count;
}
dispatch;

TABLE(0, uvec4, places)      // BatchPlace
TABLE(1, uint, targets)      // the probe's number, per receiver
TABLE(2, uvec4, records_16)  // base first, then contributions
TABLE(3, uvec2, records_8)
TABLE(4, uint, records_4)
TABLE(5, uvec4, work)        // WorkItem
TABLE(6, uvec4, terms)       // WorkTerm
layout(set = 0, binding = 7, std430) writeonly buffer Probes { uint probes[]; };  // 7 words each

const uint lanes_per_item = 16u;

DimmerProbe load_record(uint index) {
    uvec4 a = FETCH(records_16, index);
    uvec2 b = FETCH(records_8, index).xy;
    return DimmerProbe(a.x, uint[6](a.y, a.z, a.w, b.x, b.y, FETCH(records_4, index).x));
}

void store_probe(uint number, DimmerProbe probe) {
    probes[number * 7u] = probe.light;
    for (int i = 0; i < 6; ++i) probes[number * 7u + 1u + uint(i)] = probe.bands[i];
}

void main() {
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint index = group * (gl_WorkGroupSize.x / lanes_per_item) + gl_LocalInvocationIndex / lanes_per_item;
    if (index >= dispatch.item_count) return;
    uvec4 item = FETCH(work, dispatch.first_item + index);
    uvec4 place = FETCH(places, item.x);
    for (uint i = gl_LocalInvocationIndex % lanes_per_item; i < place.y; i += lanes_per_item) {
        DimmerProbe probe = load_record(place.x + i);
        if (terms_on != 0) {
            DimmerProbeBlend sum = dimmer_probe_none();
            dimmer_probe_add(sum, probe, vec3(dimmer_weight_scale(color_format)), color_format);
            uint count = terms_on < 0 || terms_on > 8 ? item.z : uint(terms_on);
            for (uint t = 0u; t < count; ++t) {
                uvec4 term = FETCH(terms, item.y + t);
                dimmer_probe_add(sum, load_record(term.x + place.z + i), uintBitsToFloat(term.yzw), color_format);
            }
            probe = dimmer_probe_encode(sum, color_format);
        }
        store_probe(FETCH(targets, place.x + i).x, probe);
    }
}
