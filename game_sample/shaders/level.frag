// A lit surface: radiance = reflectance / pi * irradiance + emission, in cd/m2.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "draw_constants.glsl"

#include "dimmer/sample.glsl"

layout(push_constant) uniform Push { DrawConstants draw; };

layout(set = 0, binding = 0) uniform sampler2DArray irradiance_pages;
layout(set = 0, binding = 1) uniform sampler2DArray direction_pages;

// Not centroid: at the edge of a triangle the pixel's centre may lie outside it, but charts are padded for that, while
// lavapipe's centroid positions are off by a part of a texel along edges (seen as faint streaks, Mesa 22.3).
layout(location = 0) in vec2 lightmap_uv;

layout(location = 0) out vec4 radiance_cd_m2;

const float INVERSE_PI = 0.318309886;

void main() {
    // No normal maps here: the shading normal is the texel's own, +Z of its tangent frame.
    vec3 irradiance_lux = dimmer_lightmap_irradiance(irradiance_pages, direction_pages, vec3(lightmap_uv, draw.page),
                                                     vec3(0.0, 0.0, 1.0), draw.exposure, draw.direction_model);
    radiance_cd_m2 = vec4(draw.reflectance * INVERSE_PI * irradiance_lux + draw.emission_cd_m2, 1.0);
}
