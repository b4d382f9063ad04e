// Light from probes in a shader: of a moving or static model's own grid, and straight from the level's global grid for
// fog, particles and volumes. The CPU twins: runtime/probes/tetrahedron_walk.cpp, <dimmer/probe_grid.h>.
//
// Before it is included, two macros must say how to read the runtime's buffers:
//
//     layout(set = 0, binding = 2, std430) readonly buffer Probes { uint probes[]; };     // Runtime::probes
//     layout(set = 0, binding = 3, std430) readonly buffer Grid { uvec4 grid_table[]; };  // Runtime::gridTable
//     #define DIMMER_PROBE_WORD(i) probes[i]
//     #define DIMMER_GRID_WORDS(i) grid_table[i]   // for the functions that take a place in the world alone
//     #include <dimmer/grid.glsl>
//     ...
//     vec3 e_lux = dimmer_model_irradiance(slot, position, normal, exposure, format);
#ifndef DIMMER_GRID_GLSL
#define DIMMER_GRID_GLSL

#include "dimmer/probe.glsl"

DimmerProbe dimmer_probe_load(uint number) {
    uint w = number * 7u;
    return DimmerProbe(DIMMER_PROBE_WORD(w),
                       uint[6](DIMMER_PROBE_WORD(w + 1u), DIMMER_PROBE_WORD(w + 2u), DIMMER_PROBE_WORD(w + 3u),
                               DIMMER_PROBE_WORD(w + 4u), DIMMER_PROBE_WORD(w + 5u), DIMMER_PROBE_WORD(w + 6u)));
}

#ifdef DIMMER_GRID_WORDS

const uint dimmer_no_tetrahedron = 0xffffffffu;
const uint dimmer_hinted_steps_max = 32u;  // these as in tetrahedron_walk.h
const uint dimmer_walk_steps_max = 1024u;
const uint dimmer_settle_steps_max = 4u;
const float dimmer_inside_tolerance = 1e-4;
const float dimmer_flat_volume = 1e-30;
const float dimmer_flat_inverse = 1e8;
const float dimmer_visibility_slope = 8.0;
const float dimmer_visible_weight_min = 1e-5;
const float dimmer_least_hidden_span = 0.25;

struct DimmerGridPlace {
    uint tetrahedron;
    vec4 barycentric;
};

// The table: min.xyz and where positions begin; max.xyz and where tetrahedra do; counts.xyz of the start grid and where
// the starts do; whether there is visibility, and how many tetrahedra. A position is one element, a tetrahedron three:
// probes, neighbours, visibility; four starts share one. See runtime/probes/grid_table.cpp.
uvec4 dimmer_tetrahedron_part(uint tetrahedron, uint part) {
    return DIMMER_GRID_WORDS(DIMMER_GRID_WORDS(1).w + 3u * tetrahedron + part);
}

vec3 dimmer_probe_position(uint number) {
    return uintBitsToFloat(DIMMER_GRID_WORDS(DIMMER_GRID_WORDS(0).w + number).xyz);
}

float dimmer_determinant(vec3 a, vec3 b, vec3 c) {
    precise float x = b.y * c.z - b.z * c.y;
    precise float y = b.z * c.x - b.x * c.z;
    precise float z = b.x * c.y - b.y * c.x;
    precise float sum = a.x * x + a.y * y + a.z * z;
    return sum;
}

vec4 dimmer_barycentric(uint tetrahedron, vec3 point) {
    uvec4 probes_of = dimmer_tetrahedron_part(tetrahedron, 0u);
    precise vec3 a = dimmer_probe_position(probes_of.x) - point, b = dimmer_probe_position(probes_of.y) - point;
    precise vec3 c = dimmer_probe_position(probes_of.z) - point, d = dimmer_probe_position(probes_of.w) - point;
    vec4 volumes = vec4(dimmer_determinant(b, c, d), dimmer_determinant(a, d, c), dimmer_determinant(a, b, d),
                        dimmer_determinant(a, c, b));
    precise float sum = volumes.x + volumes.y + volumes.z + volumes.w;
    float inverse = abs(sum) > dimmer_flat_volume ? dimmer_reciprocal(sum) : dimmer_flat_inverse;
    precise vec4 shares = volumes * inverse;
    return shares;
}

uint dimmer_smallest(vec4 values) {
    uint least = 0u;
    for (uint i = 1u; i < 4u; ++i)
        if (values[i] < values[least]) least = i;
    return least;
}

bool dimmer_walk(vec3 point, uint steps_max, inout DimmerGridPlace place) {
    for (uint step = 0u;; ++step) {
        place.barycentric = dimmer_barycentric(place.tetrahedron, point);
        uint face = dimmer_smallest(place.barycentric);
        if (!(place.barycentric[face] < -dimmer_inside_tolerance)) return true;
        uint next = dimmer_tetrahedron_part(place.tetrahedron, 1u)[face];
        if (next == dimmer_no_tetrahedron) return true;
        if (step == steps_max) return false;
        place.tetrahedron = next;
    }
}

void dimmer_settle(vec3 point, inout DimmerGridPlace place) {
    for (uint step = 0u; step < dimmer_settle_steps_max; ++step) {
        uint face = dimmer_smallest(place.barycentric);
        float depth = place.barycentric[face];
        uint next = dimmer_tetrahedron_part(place.tetrahedron, 1u)[face];
        if (!(depth < dimmer_inside_tolerance) || next == dimmer_no_tetrahedron) return;
        vec4 there = dimmer_barycentric(next, point);
        float next_depth = there[dimmer_smallest(there)];
        if (!(next_depth > depth || (next_depth == depth && next < place.tetrahedron))) return;
        place = DimmerGridPlace(next, there);
    }
}

uint dimmer_start(vec3 point, vec3 low, vec3 high) {
    uvec4 counts = DIMMER_GRID_WORDS(2);
    precise vec3 extent = high - low;
    precise vec3 from_low = point - low;
    precise vec3 share = from_low * dimmer_reciprocal(extent);
    precise vec3 cells = share * vec3(counts.xyz);
    uvec3 cell = min(uvec3(cells), counts.xyz - 1u);
    uint number = cell.x + counts.x * (cell.y + counts.y * cell.z);
    return DIMMER_GRID_WORDS(counts.w + (number >> 2))[number & 3u];
}

// `hint`: a tetrahedron that is likely near, or dimmer_no_tetrahedron.
DimmerGridPlace dimmer_locate(vec3 point, uint hint) {
    vec3 low = uintBitsToFloat(DIMMER_GRID_WORDS(0).xyz), high = uintBitsToFloat(DIMMER_GRID_WORDS(1).xyz);
    for (int i = 0; i < 3; ++i) point[i] = point[i] > low[i] ? (point[i] < high[i] ? point[i] : high[i]) : low[i];
    DimmerGridPlace place = DimmerGridPlace(hint, vec4(0));
    bool hinted = hint < DIMMER_GRID_WORDS(3).y;
    bool found = hinted && dimmer_walk(point, dimmer_hinted_steps_max, place);
    if (found) {
        dimmer_settle(point, place);
        // At a face the hint would still have a say, where many tetrahedra meet.
        found = place.barycentric[dimmer_smallest(place.barycentric)] > dimmer_inside_tolerance;
    }
    if (!found) {
        place.tetrahedron = dimmer_start(point, low, high);
        dimmer_walk(point, dimmer_walk_steps_max, place);
        dimmer_settle(point, place);
    }
    precise vec4 weights;
    for (int i = 0; i < 4; ++i) {
        float w = place.barycentric[i];
        weights[i] = w > 0.0 ? (w < 1.0 ? w : 1.0) : 0.0;
    }
    precise float sum = weights.x + weights.y + weights.z + weights.w;
    precise vec4 shares = weights * dimmer_reciprocal(sum);
    place.barycentric = sum > 0.0 ? shares : vec4(0.25);
    return place;
}

// The shares of the tetrahedron's four probes.
vec4 dimmer_probe_weights(DimmerGridPlace place) {
    vec4 b = place.barycentric;
    if (DIMMER_GRID_WORDS(3).x == 0u) return b;
    uvec4 seen = dimmer_tetrahedron_part(place.tetrahedron, 2u);
    precise vec4 weights, visible;
    for (int v = 0; v < 4; ++v) {
        precise float field = b.x * float(bitfieldExtract(int(seen[v]), 0, 8)) +
                              b.y * float(bitfieldExtract(int(seen[v]), 8, 8)) +
                              b.z * float(bitfieldExtract(int(seen[v]), 16, 8)) +
                              b.w * float(bitfieldExtract(int(seen[v]), 24, 8));
        visible[v] = field * (dimmer_visibility_slope / 127.0);
        float clamped = visible[v] > 0.0 ? (visible[v] < 1.0 ? visible[v] : 1.0) : 0.0;
        weights[v] = b[v] * clamped;
    }
    precise float sum = weights.x + weights.y + weights.z + weights.w;
    if (!(sum > dimmer_visible_weight_min)) {
        float most = -2.0 * dimmer_visibility_slope;
        for (int v = 0; v < 4; ++v)
            if (b[v] > dimmer_visible_weight_min && visible[v] > most) most = visible[v];
        for (int v = 0; v < 4; ++v) {
            precise float above = visible[v] - (most - dimmer_least_hidden_span);
            weights[v] = b[v] * (above > 0.0 ? above : 0.0);
        }
        sum = weights.x + weights.y + weights.z + weights.w;
    }
    precise vec4 shares = weights * dimmer_reciprocal(sum);
    return shares;
}

#endif

// Radiance over all directions, spherical harmonics of bands 0..2 in the order of a probe's bytes.
struct DimmerRadiance {
    vec3 coefficients[9];
};

void dimmer_radiance_add(inout DimmerRadiance sum, DimmerProbe probe, float weight, uint format) {
    // What is lifted and scaled is 2^-12 of the light; see weightScale in runtime/format/texel.h.
    vec3 light = 4096.0 * weight * (dimmer_lift(probe.light, format) * dimmer_weight_scale(format));
    sum.coefficients[0] += light;
    for (int i = 0; i < dimmer_probe_triples; ++i) {
        // Codes carry 128; a coefficient is light * sqrt(2l + 1) * code / 127.
        vec3 codes = vec3(dimmer_probe_code(probe, 3 * i), dimmer_probe_code(probe, 3 * i + 1),
                          dimmer_probe_code(probe, 3 * i + 2)) - 128.0;
        sum.coefficients[1 + i] += light * codes * ((i < 3 ? 1.73205081 : 2.23606798) / 127.0);
    }
}

// Sum of Y_lm(direction) * band[l] * L_lm; direction of length 1.
vec3 dimmer_radiance_sum(DimmerRadiance radiance, vec3 d, vec3 band) {
    vec3 sum = band.x * 0.282094792 * radiance.coefficients[0];
    sum += band.y * 0.488602512 *
           (d.y * radiance.coefficients[1] + d.z * radiance.coefficients[2] + d.x * radiance.coefficients[3]);
    sum += band.z * (1.092548431 * (d.x * d.y * radiance.coefficients[4] + d.y * d.z * radiance.coefficients[5] +
                                    d.x * d.z * radiance.coefficients[7]) +
                     0.315391565 * (3.0 * d.z * d.z - 1.0) * radiance.coefficients[6] +
                     0.546274215 * (d.x * d.x - d.y * d.y) * radiance.coefficients[8]);
    return sum;
}

// Irradiance in lux on a surface with this unit normal: the cosine's bands are pi, 2 pi / 3, pi / 4 (Ramamoorthi and
// Hanrahan 2001).
vec3 dimmer_radiance_irradiance(DimmerRadiance radiance, vec3 normal) {
    return max(dimmer_radiance_sum(radiance, normal, vec3(3.14159265, 2.09439510, 0.785398163)), vec3(0));
}

// The cosine-weighted visibility of a surface: irradiance is the sum of products with the radiance's coefficients. See
// LightTransfer in <dimmer/model_mesh.h>.
struct DimmerTransfer {
    vec3 coefficients[3];  // nine, in order
};

// Irradiance in lux on a surface that knows what of its surroundings it sees.
vec3 dimmer_transferred_irradiance(DimmerRadiance radiance, DimmerTransfer transfer) {
    vec3 sum = vec3(0);
    for (int i = 0; i < 9; ++i) sum += transfer.coefficients[i / 3][i % 3] * radiance.coefficients[i];
    return max(sum, vec3(0));
}

// A unit vector from two SNORMs (octahedral).
vec3 dimmer_model_normal(vec2 octahedral) {
    vec3 n = vec3(octahedral, 1.0 - abs(octahedral.x) - abs(octahedral.y));
    float fold = max(-n.z, 0.0);
    n.x += n.x >= 0.0 ? -fold : fold;
    n.y += n.y >= 0.0 ? -fold : fold;
    return normalize(n);
}

// Of a vertex of ModelMesh, whose nine SNORMs these are, in the world's axes.
//   world_from_model   rotation; where the model is scaled, its columns divided by their lengths
DimmerTransfer dimmer_transfer(vec4 first, vec4 second, float last, mat3 world_from_model) {
    const vec3 bounds = vec3(0.886226925, 1.02332671, 0.661);  // transfer_bounds
    vec3 lobe = world_from_model * (bounds.y * vec3(first.w, first.y, first.z));
    // Band 2 as w.M w; the factors of its harmonics are 1.092548431 (products), 0.315391565, 0.546274215.
    vec4 products = 0.546274215 * bounds.z * vec4(second.x, second.y, second.w, last);  // xy, yz, xz; x2 - y2
    float polar = 0.315391565 * bounds.z * second.z;
    mat3 m = mat3(products.w - polar, products.x, products.z,
                  products.x, -products.w - polar, products.y,
                  products.z, products.y, 2.0 * polar);
    m = world_from_model * m * transpose(world_from_model);
    const float inverse = 1.0 / 0.546274215;
    return DimmerTransfer(vec3[3](vec3(bounds.x * first.x, lobe.y, lobe.z),
                                  vec3(lobe.x, inverse * m[1][0], inverse * m[2][1]),
                                  vec3(m[2][2] / 0.63078313, inverse * m[2][0], 0.5 * inverse * (m[0][0] - m[1][1]))));
}

// ModelSlot of <dimmer/models.h>, as std140 and std430 lay it out alike.
struct DimmerModelSlot {
    uvec4 first_probe_counts;  // first_probe, counts.xyz
    vec4 grid_from_world[3];   // rows
};

// What arrives at a place of a model, cd/m2: linear between its probes. Of a slot without probes (no model): nothing.
DimmerRadiance dimmer_model_radiance(DimmerModelSlot slot, vec3 position, float exposure, uint format) {
    uvec3 counts = slot.first_probe_counts.yzw;
    DimmerRadiance sum;
    for (int i = 0; i < 9; ++i) sum.coefficients[i] = vec3(0);
    if (counts.x == 0u || counts.y == 0u || counts.z == 0u) return sum;
    vec3 at = vec3(dot(slot.grid_from_world[0], vec4(position, 1)), dot(slot.grid_from_world[1], vec4(position, 1)),
                   dot(slot.grid_from_world[2], vec4(position, 1)));
    at = clamp(at, vec3(0), vec3(counts - 1u));
    uvec3 low = min(uvec3(at), max(counts, uvec3(2)) - 2u);
    vec3 share = at - vec3(low);
    for (uint corner = 0u; corner < 8u; ++corner) {
        uvec3 step = uvec3(corner & 1u, corner >> 1 & 1u, corner >> 2);
        vec3 shares = mix(1.0 - share, share, vec3(step));
        float weight = shares.x * shares.y * shares.z;
        if (weight <= 0.0) continue;
        uvec3 cell = low + step;
        uint number = slot.first_probe_counts.x + cell.x + counts.x * (cell.y + counts.y * cell.z);
        dimmer_radiance_add(sum, dimmer_probe_load(number), weight / exposure, format);
    }
    return sum;
}

// Irradiance in lux on a model's surface.
//   position, normal   world space; the normal of length 1
//   exposure, format   Pack::exposure(), Pack::colorFormat(): best a constant or a specialisation constant
vec3 dimmer_model_irradiance(DimmerModelSlot slot, vec3 position, vec3 normal, float exposure, uint format) {
    return dimmer_radiance_irradiance(dimmer_model_radiance(slot, position, exposure, format), normal);
}

// The same with the model's shadow on itself; `transfer` of its vertices, interpolated.
vec3 dimmer_model_irradiance_shadowed(DimmerModelSlot slot, vec3 position, DimmerTransfer transfer, float exposure,
                                      uint format) {
    return dimmer_transferred_irradiance(dimmer_model_radiance(slot, position, exposure, format), transfer);
}

#ifdef DIMMER_GRID_WORDS

// What arrives at a place in the open air, straight from the global grid. Costs a walk through some tetrahedra.
DimmerRadiance dimmer_volume_radiance(vec3 position, float exposure, uint format) {
    DimmerGridPlace place = dimmer_locate(position, dimmer_no_tetrahedron);
    vec4 weights = dimmer_probe_weights(place);
    uvec4 numbers = dimmer_tetrahedron_part(place.tetrahedron, 0u);
    DimmerRadiance sum;
    for (int i = 0; i < 9; ++i) sum.coefficients[i] = vec3(0);
    for (int i = 0; i < 4; ++i)
        dimmer_radiance_add(sum, dimmer_probe_load(numbers[i]), weights[i] / exposure, format);
    return sum;
}

// Irradiance in lux on a surface there.
vec3 dimmer_grid_irradiance(vec3 position, vec3 normal, float exposure, uint format) {
    return dimmer_radiance_irradiance(dimmer_volume_radiance(position, exposure, format), normal);
}

#endif

#endif
