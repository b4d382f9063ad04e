// A sphere as the shaders read it; Sphere of sphere_renderer.h.
layout(set = 0, binding = 0, std430) readonly buffer Probes { uint probes[]; };
#define DIMMER_PROBE_WORD(i) probes[i]
#include "dimmer/grid.glsl"

struct Sphere {
    vec4 centre_radius;  // m
    vec4 reflectance;
    DimmerModelSlot light;
};
layout(set = 0, binding = 1, std430) readonly buffer Spheres { Sphere spheres[]; };
