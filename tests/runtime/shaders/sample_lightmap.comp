// Calls sample.glsl at given places, for sample_glsl_test.cpp.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DIMMER_NO_DERIVATIVES
#include "dimmer/sample.glsl"

layout(local_size_x = 64) in;

struct Query {
    vec4 uv_page;         // w: exposure
    vec4 normal_tangent;  // w: directional model
};

layout(set = 0, binding = 0) uniform sampler2DArray irradiance_pages;
layout(set = 0, binding = 1) uniform sampler2DArray direction_pages;
layout(set = 0, binding = 2, std430) readonly buffer Queries { Query queries[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Results { vec4 irradiance_lux[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= queries.length()) return;
    Query query = queries[i];
    irradiance_lux[i] = vec4(dimmer_lightmap_irradiance(irradiance_pages, direction_pages, query.uv_page.xyz,
                                                        query.normal_tangent.xyz, query.uv_page.w,
                                                        uint(query.normal_tangent.w)),
                             0);
}
