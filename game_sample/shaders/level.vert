#version 450
#extension GL_GOOGLE_include_directive : require
#include "draw_constants.glsl"

layout(push_constant) uniform Push { DrawConstants draw; };

layout(location = 0) in vec3 position_m;
layout(location = 1) in vec2 lightmap_uv;

layout(location = 0) out vec2 out_lightmap_uv;

void main() {
    gl_Position = draw.clip_from_world * vec4(position_m, 1.0);
    out_lightmap_uv = lightmap_uv;
}
