#include <probes/tetrahedron_walk.h>

#include <format/reciprocal.h>

#include <algorithm>
#include <cmath>

namespace dimmer {
namespace {

using Vec3 = std::array<float, 3>;

// The box's nearest point; a NaN becomes its lower corner.
Vec3 clampToBox(const StartGrid& box, const Vec3& p) {
    Vec3 out;
    for (size_t i = 0; i < 3; ++i)
        out[i] = p[i] > box.min_m[i] ? (p[i] < box.max_m[i] ? p[i] : box.max_m[i]) : box.min_m[i];
    return out;
}

uint32_t startOf(const GlobalGrid& grid, const Vec3& p) {
    const StartGrid& box = grid.start;
    std::array<uint32_t, 3> cell;
    for (size_t i = 0; i < 3; ++i) {
        const float share = (p[i] - box.min_m[i]) * reciprocal(box.max_m[i] - box.min_m[i]);
        cell[i] = std::min(static_cast<uint32_t>(share * static_cast<float>(box.counts[i])), box.counts[i] - 1);
    }
    return grid.starts[cell[0] + size_t{box.counts[0]} * (cell[1] + size_t{box.counts[1]} * cell[2])];
}

Vec3 fromTo(const Vec3& from, const ProbePosition& to) {
    return {to.x_m - from[0], to.y_m - from[1], to.z_m - from[2]};
}

float determinant(const Vec3& a, const Vec3& b, const Vec3& c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

// Ratios of the volumes between the point and each face to the whole. Where that is nothing to a float, as of a flat
// tetrahedron, they are large instead, so that a walk goes on, and numbers: a shader's compiler may turn a comparison
// round as if there were no others. (Of positions 1e12 m apart they need not be; the cooker refuses 1e6 m.)
std::array<float, 4> barycentricOf(const GlobalGrid& grid, uint32_t tetrahedron, const Vec3& point) {
    const auto& probes = grid.tetrahedra[tetrahedron].probes;
    const Vec3 a = fromTo(point, grid.positions[probes[0]]), b = fromTo(point, grid.positions[probes[1]]);
    const Vec3 c = fromTo(point, grid.positions[probes[2]]), d = fromTo(point, grid.positions[probes[3]]);
    const std::array<float, 4> volumes = {determinant(b, c, d), determinant(a, d, c), determinant(a, b, d),
                                          determinant(a, c, b)};
    const float sum = volumes[0] + volumes[1] + volumes[2] + volumes[3];
    const float inverse = std::abs(sum) > flat_volume ? reciprocal(sum) : flat_inverse;
    return {volumes[0] * inverse, volumes[1] * inverse, volumes[2] * inverse, volumes[3] * inverse};
}

// Onto 0..1 with sum 1, whatever it was.
std::array<float, 4> clampWeights(std::array<float, 4> weights) {
    float sum = 0;
    for (float& w : weights) {
        w = w > 0 ? (w < 1 ? w : 1.0f) : 0.0f;
        sum += w;
    }
    if (!(sum > 0)) return {0.25f, 0.25f, 0.25f, 0.25f};
    const float inverse = reciprocal(sum);
    for (float& w : weights) w *= inverse;
    return weights;
}

size_t smallest(const std::array<float, 4>& values) {
    size_t least = 0;
    for (size_t i = 1; i < 4; ++i)
        if (values[i] < values[least]) least = i;
    return least;
}

// Goes on through the face that the point is furthest beyond. In a Delaunay tetrahedralisation that never comes back
// (Edelsbrunner 1990), but for rounding, and for tables that are not one: hence the limit. True when it arrived.
bool walk(const GlobalGrid& grid, const Vec3& point, uint32_t steps_max, GridPlace& place) {
    for (uint32_t step = 0;; ++step) {
        place.barycentric = barycentricOf(grid, place.tetrahedron, point);
        const size_t face = smallest(place.barycentric);
        // So written that what is not a number ends the walk.
        if (!(place.barycentric[face] < -inside_tolerance)) return true;
        const uint32_t next = grid.tetrahedra[place.tetrahedron].neighbours[face];
        if (next == no_tetrahedron) return true;  // a point on the hull, by rounding outside
        if (step == steps_max) return false;
        place.tetrahedron = next;
    }
}

// To the neighbour that the point lies deeper in; of two equal ones, to the first.
void settle(const GlobalGrid& grid, const Vec3& point, GridPlace& place) {
    for (uint32_t step = 0; step < settle_steps_max; ++step) {
        const size_t face = smallest(place.barycentric);
        const float depth = place.barycentric[face];
        const uint32_t next = grid.tetrahedra[place.tetrahedron].neighbours[face];
        if (!(depth < inside_tolerance) || next == no_tetrahedron) return;
        const std::array<float, 4> there = barycentricOf(grid, next, point);
        const float next_depth = there[smallest(there)];
        if (!(next_depth > depth || (next_depth == depth && next < place.tetrahedron))) return;
        place = {next, there};
    }
}

}  // namespace

GridPlace locate(const GlobalGrid& grid, std::array<float, 3> point_m, uint32_t hint, uint32_t steps_max) {
    const Vec3 point = clampToBox(grid.start, point_m);
    GridPlace place;
    place.tetrahedron = hint;
    const bool hinted = hint < grid.tetrahedra.size();
    bool found = hinted && walk(grid, point, hinted_steps_max, place);
    if (found) {
        settle(grid, point, place);
        // At a face the hint would still have a say, where many tetrahedra meet.
        found = place.barycentric[smallest(place.barycentric)] > inside_tolerance;
    }
    if (!found) {
        place.tetrahedron = startOf(grid, point);
        walk(grid, point, steps_max, place);
        settle(grid, point, place);
    }
    place.barycentric = clampWeights(place.barycentric);
    return place;
}

std::array<float, 4> probeWeights(const GlobalGrid& grid, const GridPlace& place) {
    if (grid.visibility.empty()) return place.barycentric;
    const auto& seen = grid.visibility[place.tetrahedron].seen;
    const std::array<float, 4>& b = place.barycentric;
    std::array<float, 4> weights, visible;
    float sum = 0;
    for (size_t v = 0; v < 4; ++v) {
        const float field = b[0] * static_cast<float>(seen[v][0]) + b[1] * static_cast<float>(seen[v][1]) +
                            b[2] * static_cast<float>(seen[v][2]) + b[3] * static_cast<float>(seen[v][3]);
        visible[v] = field * (visibility_slope / 127.0f);
        weights[v] = b[v] * (visible[v] > 0 ? (visible[v] < 1 ? visible[v] : 1.0f) : 0.0f);
        sum += weights[v];
    }
    if (!(sum > visible_weight_min)) {
        float most = -2 * visibility_slope;
        for (size_t v = 0; v < 4; ++v)
            if (b[v] > visible_weight_min && visible[v] > most) most = visible[v];
        sum = 0;
        for (size_t v = 0; v < 4; ++v) {
            const float above = visible[v] - (most - least_hidden_span);
            weights[v] = b[v] * (above > 0 ? above : 0.0f);
            sum += weights[v];
        }
    }
    const float inverse = reciprocal(sum);
    for (float& w : weights) w *= inverse;
    return weights;
}

}  // namespace dimmer
