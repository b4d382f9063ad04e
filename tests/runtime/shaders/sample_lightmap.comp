// Calls sample.glsl at given places, for sample_glsl_test.cpp.
#version 450
#extension GL_GOOGLE_include_directive : require

// A compute shader has no derivatives: those of the query.
vec3 position_dx, position_dy;
vec2 uv_dx, uv_dy;
vec3 given_dx(vec3 position) { return position_dx; }
vec3 given_dy(vec3 position) { return position_dy; }
vec2 given_dx(vec2 uv) { return uv_dx; }
vec2 given_dy(vec2 uv) { return uv_dy; }
#define dFdx given_dx
#define dFdy given_dy
#include "dimmer/sample.glsl"

layout(local_size_x = 64) in;

struct Query {
    vec4 uv_page;  // w: exposure
    vec4 normal;   // world space; w: directional model
    vec4 mesh_normal;
    vec4 position_dx, position_dy;
    vec4 uv_dx_dy;
};

layout(set = 0, binding = 0) uniform sampler2DArray irradiance_pages;
layout(set = 0, binding = 1) uniform sampler2DArray direction_pages;
layout(set = 0, binding = 2, std430) readonly buffer Queries { Query queries[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Results { vec4 irradiance_lux[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= queries.length()) return;
    Query query = queries[i];
    position_dx = query.position_dx.xyz;
    position_dy = query.position_dy.xyz;
    uv_dx = query.uv_dx_dy.xy;
    uv_dy = query.uv_dx_dy.zw;
    mat3 world_from_tangent = dimmer_world_from_tangent(vec3(0), query.mesh_normal.xyz, vec2(0));
    irradiance_lux[i] = vec4(dimmer_lightmap_irradiance(irradiance_pages, direction_pages, query.uv_page.xyz,
                                                        query.normal.xyz * world_from_tangent, query.uv_page.w,
                                                        uint(query.normal.w)),
                             0);
}
