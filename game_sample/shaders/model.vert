// A mesh that a light grid lights, with quantised vertices: dimmer::ModelVertex.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "draw_constants.glsl"
#include "model.glsl"

layout(push_constant) uniform Push { ModelConstants draw; };

layout(location = 0) in vec4 position;
layout(location = 1) in vec2 normal;
layout(location = 2) in vec4 transfer_first;
layout(location = 3) in vec4 transfer_second;
layout(location = 4) in float transfer_last;

layout(location = 0) out vec3 out_position_m;
layout(location = 1) out vec3 out_normal;
layout(location = 2) flat out uint out_draw;
layout(location = 3) out vec3 out_transfer[3];

void main() {
    ModelDraw model = draws[gl_InstanceIndex];
    vec4 inside = vec4(model.box_min.xyz + position.xyz * model.box_side.xyz, 1);
    out_position_m = vec3(dot(model.world_from_model[0], inside), dot(model.world_from_model[1], inside),
                          dot(model.world_from_model[2], inside));
    // Rigid: no column needs its length taken out.
    mat3 world_from_model = transpose(mat3(model.world_from_model[0].xyz, model.world_from_model[1].xyz,
                                           model.world_from_model[2].xyz));
    out_normal = world_from_model * dimmer_model_normal(normal);
    out_transfer = dimmer_transfer(transfer_first, transfer_second, transfer_last, world_from_model).coefficients;
    out_draw = gl_InstanceIndex;
    gl_Position = draw.clip_from_world * vec4(out_position_m, 1);
}
