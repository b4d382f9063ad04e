// A surface lit by its model's light grid: radiance = reflectance / pi * irradiance + emission, cd/m2.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "draw_constants.glsl"
#include "model.glsl"

layout(push_constant) uniform Push { ModelConstants draw; };

layout(location = 0) in vec3 position_m;
layout(location = 1) in vec3 normal;
layout(location = 2) flat in uint index;
layout(location = 3) in vec3 transfer[3];

layout(location = 0) out vec4 radiance_cd_m2;

const float INVERSE_PI = 0.318309886;

void main() {
    vec3 irradiance_lux =
        draw.self_visibility != 0u
            ? dimmer_model_irradiance_shadowed(draws[index].light, position_m, DimmerTransfer(transfer),
                                               draw.exposure, draw.color_format)
            : dimmer_model_irradiance(draws[index].light, position_m, normalize(normal), draw.exposure,
                                      draw.color_format);
    radiance_cd_m2 = vec4(draws[index].reflectance.rgb * INVERSE_PI * irradiance_lux +
                              draws[index].emission_cd_m2.rgb, 1);
}
