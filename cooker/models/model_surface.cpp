#include <models/model_surface.h>

#include <bake/sampling.h>
#include <probes/free_space.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

constexpr uint32_t tries_per_place = 4;
constexpr float place_lift_m = 1e-3f;
constexpr uint32_t place_seed = 0x3c6ef372u;

struct Sides {
    std::vector<uint32_t> face;  // triangle_faces + ...
    std::vector<double> cumulative_m2;

    uint32_t drawn(float chance) const {
        const double target = static_cast<double>(chance) * cumulative_m2.back();
        auto at = std::ranges::upper_bound(cumulative_m2, target);
        if (at == cumulative_m2.end()) --at;
        return face[static_cast<size_t>(at - cumulative_m2.begin())];
    }
};

Sides sidesOf(const RayScene& rays, uint32_t model) {
    const Scene& scene = rays.scene();
    Sides sides;
    double sum = 0;
    forTriangles(rays, model, [&](uint32_t t, const LevelTriangle& triangle) {
        const glm::vec3 a = rays.corner(t, 0);
        const double area_m2 =
            0.5 * static_cast<double>(glm::length(glm::cross(rays.corner(t, 1) - a, rays.corner(t, 2) - a)));
        for (uint32_t back = 0; back <= uint32_t{scene.materials[triangle.material].double_sided}; ++back) {
            sides.face.push_back(triangle_faces + 2 * t + back);
            sides.cumulative_m2.push_back(sum += area_m2);
        }
    });
    return sides;
}

// Of a place at (u, v) of a triangle's side, in the world's axes.
LightTransfer transferAt(const Scene& scene, const SceneModel& model, const LevelTriangle& triangle, bool back, float u,
                         float v) {
    const auto mesh = static_cast<size_t>(std::ranges::find(model.meshes, triangle.mesh) - model.meshes.begin());
    const glm::uvec3 corners = scene.meshes[triangle.mesh].triangles[triangle.triangle];
    const std::array weights{1 - u - v, u, v};
    LightTransfer inside;
    for (size_t c = 0; c < 3; ++c) {
        const LightTransfer& of_vertex = (*model.transfers)[mesh][corners[static_cast<int>(c)]][back];
        for (size_t k = 0; k < 9; ++k) inside.coefficients[k] += weights[c] * of_vertex.coefficients[k];
    }
    Transform world_from_model;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            world_from_model.rows[static_cast<size_t>(r)][static_cast<size_t>(c)] = model.world_from_model[c][r];
    return turned(inside, world_from_model);
}

}  // namespace

std::vector<ModelPlace> modelPlaces(const RayScene& rays, uint32_t index, uint32_t count) {
    const SceneModel& model = rays.scene().models[index];
    std::vector<ModelPlace> places;
    if (!model.transfers) return places;
    const Sides sides = sidesOf(rays, index);
    if (sides.face.empty() || !(sides.cumulative_m2.back() > 0)) return places;
    for (uint32_t i = 0; places.size() < count && i < tries_per_place * count; ++i) {
        const glm::vec3 draw = sequence3d(i, hash(place_seed, index));
        const uint32_t face = sides.drawn(draw.z), t = (face - triangle_faces) / 2;
        const bool back = face % 2;
        const glm::vec2 at = uniformOnTriangle(glm::vec2(draw));
        const LevelTriangle& triangle = rays.triangles()[t];
        const glm::vec3 on = rays.pointOn(t, at.x, at.y);
        const glm::vec3 p = on + (back ? -place_lift_m : place_lift_m) * triangle.normal;
        // The model's own fronts would make up for backs of what else is there.
        if (!inTheOpen(rays, p, index, 0) || !inTheOpen(rays, p, no_model, 0)) continue;
        places.push_back(
            {{p, face}, nearProbes(model, on), transferAt(rays.scene(), model, triangle, back, at.x, at.y)});
    }
    return places;
}

}  // namespace dimmer::cook
