// A sphere lit by probes of its own: radiance = reflectance / pi * irradiance, cd/m2.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "draw_constants.glsl"
#include "sphere.glsl"

layout(push_constant) uniform Push { SphereConstants draw; };

layout(location = 0) in vec3 position_m;
layout(location = 1) in vec3 normal;
layout(location = 2) flat in uint sphere;

layout(location = 0) out vec4 radiance_cd_m2;

const float INVERSE_PI = 0.318309886;

void main() {
    vec3 irradiance_lux = dimmer_model_irradiance(spheres[sphere].light, position_m, normalize(normal), draw.exposure,
                                                  draw.color_format);
    radiance_cd_m2 = vec4(spheres[sphere].reflectance.rgb * INVERSE_PI * irradiance_lux, 1.0);
}
