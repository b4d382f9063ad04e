// Spheres without vertex buffers: two triangles per cell of a grid of latitudes and longitudes.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "draw_constants.glsl"
#include "sphere.glsl"

layout(push_constant) uniform Push { SphereConstants draw; };

layout(location = 0) out vec3 position_m;
layout(location = 1) out vec3 normal;
layout(location = 2) flat out uint sphere;

const uint columns = 24u, rows = 12u;  // sphere_vertices of sphere_renderer.cpp
const uvec2 corners[6] = uvec2[6](uvec2(0, 0), uvec2(0, 1), uvec2(1, 1), uvec2(0, 0), uvec2(1, 1), uvec2(1, 0));
const float pi = 3.14159265;

void main() {
    uint cell = gl_VertexIndex / 6u;
    uvec2 corner = uvec2(cell % columns, cell / columns) + corners[gl_VertexIndex % 6u];
    float longitude = 2.0 * pi * float(corner.x) / float(columns), latitude = pi * float(corner.y) / float(rows);
    normal = vec3(sin(latitude) * sin(longitude), cos(latitude), sin(latitude) * cos(longitude));
    vec4 place = spheres[gl_InstanceIndex].centre_radius;
    position_m = place.xyz + place.w * normal;
    sphere = gl_InstanceIndex;
    gl_Position = draw.clip_from_world * vec4(position_m, 1.0);
}
