// Reading the lightmap in a shader. The CPU twin is sampleLightmap in <dimmer/cpu_runtime.h>.
//
//     layout(set = 0, binding = 0) uniform sampler2DArray irradiance_pages;  // LightmapImages::irradiance_view
//     layout(set = 0, binding = 1) uniform sampler2DArray direction_pages;   // LightmapImages::direction_view
//     ...
//     mat3 world_from_tangent = dimmer_world_from_tangent(position, normal, lightmap_uv);
//     vec3 e_lux = dimmer_lightmap_irradiance(irradiance_pages, direction_pages, vec3(lightmap_uv, page),
//                                             shading_normal * world_from_tangent, exposure, model);
//     vec3 radiance_cd_m2 = albedo / pi * e_lux;
//
// Both with LightmapImages::sampler (bilinear, clamp to edge).
#ifndef DIMMER_SAMPLE_GLSL
#define DIMMER_SAMPLE_GLSL

#include "dimmer/texel.glsl"

const uint dimmer_model_ahd = 0u;
const uint dimmer_model_linear = 1u;

// Irradiance in lux, linear Rec.709.
//   uv_page         lightmap UV, 0..1 over the page, and the page
//   normal_tangent  unit normal in the texel's tangent frame; (0,0,1) is the surface's own
//   exposure        Pack::exposure(): stored value = physical value * exposure
//   model           Pack::directionModel(): best a constant or a specialisation constant
vec3 dimmer_lightmap_irradiance(sampler2DArray irradiance, sampler2DArray direction, vec3 uv_page, vec3 normal_tangent,
                                float exposure, uint model) {
    vec3 e_z = texture(irradiance, uv_page).rgb;
    vec3 h = dimmer_highlight_from_unorm(texture(direction, uv_page).rgb);
    // E(n) = E_z (r + max(0, b.n_xy + (1-r) n_z)), or "linear" E_z max(0, r + ...); see runtime/format/texel.h.
    float highlight = dot(h.yz, normal_tangent.xy) + (1.0 - h.x) * normal_tangent.z;
    float falloff = model == dimmer_model_ahd ? h.x + max(highlight, 0.0) : max(h.x + highlight, 0.0);
    return e_z * (falloff / exposure);
}

// The tangent frame of the lightmap, columns t, b, n. n is `normal`, the mesh's own unit normal; t lies in the surface
// and points where lightmap u increases, b where v increases. On a mirrored unwrap the frame is left-handed: n never
// leaves the mesh's side. Derived alike by the cooker from each triangle's corners.
//   dp_du, dp_dv    any positive multiples of the position's derivatives by u and v
mat3 dimmer_tangent_frame(vec3 normal, vec3 dp_du, vec3 dp_dv) {
    vec3 along_u = dp_du - normal * dot(normal, dp_du);
    float length2 = dot(along_u, along_u);
    // Without usable UVs any tangent will do; such texels hold no direction.
    if (!(length2 > 0.0)) along_u = abs(normal.x) < 0.9 ? cross(normal, vec3(1, 0, 0)) : cross(normal, vec3(0, 1, 0));
    vec3 tangent = normalize(along_u);
    vec3 bitangent = cross(normal, tangent);
    if (dot(bitangent, dp_dv) < 0.0) bitangent = -bitangent;
    return mat3(tangent, bitangent, normal);
}

#ifndef DIMMER_NO_DERIVATIVES
// The same in a fragment shader, from the screen-space derivatives of what is interpolated: call it in uniform control
// flow. One frame for all of a triangle, but for the interpolated normal.
//   position     of the surface, world space (any space: the frame is in the same one)
//   normal       the mesh's unit normal, same space
//   lightmap_uv  as in dimmer_lightmap_irradiance
mat3 dimmer_world_from_tangent(vec3 position, vec3 normal, vec2 lightmap_uv) {
    vec3 dp_dx = dFdx(position), dp_dy = dFdy(position);
    vec2 uv_dx = dFdx(lightmap_uv), uv_dy = dFdy(lightmap_uv);
    // Solve [dp_dx dp_dy] = [dp_du dp_dv] * [uv_dx uv_dy]; the sign of the determinant is all that its value matters for.
    float orientation = uv_dx.x * uv_dy.y - uv_dy.x * uv_dx.y < 0.0 ? -1.0 : 1.0;
    vec3 dp_du = orientation * (dp_dx * uv_dy.y - dp_dy * uv_dx.y);
    vec3 dp_dv = orientation * (dp_dy * uv_dx.x - dp_dx * uv_dy.x);
    return dimmer_tangent_frame(normal, dp_du, dp_dv);
}
#endif

#endif
