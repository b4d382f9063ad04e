// Calls grid.glsl at given places, for models_test.cpp.
#version 450
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

struct Query {
    vec4 position;  // w: exposure
    vec4 normal;    // w: colour format
    vec4 transfer[3];  // nine SNORMs of a vertex
    vec4 world_from_model[3];  // rows
};

layout(set = 0, binding = 0, std430) readonly buffer Probes { uint probes[]; };
layout(set = 0, binding = 1, std430) readonly buffer Grid { uvec4 grid_table[]; };
#define DIMMER_PROBE_WORD(i) probes[i]
#define DIMMER_GRID_WORDS(i) grid_table[i]
#include "dimmer/grid.glsl"

layout(set = 0, binding = 2, std430) readonly buffer Slot { DimmerModelSlot model; };
layout(set = 0, binding = 3, std430) readonly buffer Queries { Query queries[]; };
// Of the model, of the global grid, and of the model with its shadow on itself.
layout(set = 0, binding = 4, std430) writeonly buffer Results { vec4 irradiance_lux[][3]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= queries.length()) return;
    vec3 position = queries[i].position.xyz, normal = queries[i].normal.xyz;
    float exposure = queries[i].position.w;
    uint format = uint(queries[i].normal.w);
    irradiance_lux[i][0] = vec4(dimmer_model_irradiance(model, position, normal, exposure, format), 0);
    irradiance_lux[i][1] = vec4(dimmer_grid_irradiance(position, normal, exposure, format), 0);
    mat3 world_from_model = transpose(mat3(queries[i].world_from_model[0].xyz, queries[i].world_from_model[1].xyz,
                                           queries[i].world_from_model[2].xyz));
    DimmerTransfer transfer = dimmer_transfer(queries[i].transfer[0], queries[i].transfer[1],
                                              queries[i].transfer[2].x, world_from_model);
    irradiance_lux[i][2] = vec4(dimmer_model_irradiance_shadowed(model, position, transfer, exposure, format), 0);
}
