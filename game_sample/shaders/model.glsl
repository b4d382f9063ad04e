// A model's mesh as the shaders read it; ModelDraw of model_renderer.h.
layout(set = 0, binding = 0, std430) readonly buffer Probes { uint probes[]; };
#define DIMMER_PROBE_WORD(i) probes[i]
#include "dimmer/grid.glsl"

struct ModelDraw {
    DimmerModelSlot light;
    vec4 world_from_model[3];  // rows
    vec4 box_min, box_side;    // of its positions, m
    vec4 reflectance, emission_cd_m2;
};
layout(set = 0, binding = 1, std430) readonly buffer Draws { ModelDraw draws[]; };
