// Scenes whose light is a closed form, built in memory.
#pragma once

#include <scene/scene.h>

#include <cmath>
#include <numbers>
#include <optional>

namespace dimmer::cook::test {

constexpr double pi_d = std::numbers::pi;

// Lambert with exactly this reflectance (no specular share is added).
inline Material lambert(float rho) {
    Material m;
    m.base_color = glm::vec3(rho);
    m.specular = 0;
    return m;
}

inline Material emissive(glm::vec3 radiance_cd_m2, float rho = 0) {
    Material m = lambert(rho);
    m.emission_cd_m2 = radiance_cd_m2;
    return m;
}

inline uint32_t addMaterial(Scene& scene, const Material& material) {
    scene.materials.push_back(material);
    return static_cast<uint32_t>(scene.materials.size() - 1);
}

// Adds the parallelogram centre +- u +- v; its front faces along u x v.
inline SceneMesh& addQuad(Scene& scene, const char* node, glm::vec3 centre, glm::vec3 u, glm::vec3 v,
                          uint32_t material) {
    SceneMesh mesh;
    mesh.node = node;
    mesh.positions_m = {centre - u - v, centre + u - v, centre + u + v, centre - u + v};
    mesh.normals.assign(4, glm::normalize(glm::cross(u, v)));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.triangle_materials = {material, material};
    mesh.lighting = Lighting::Lightmap;
    scene.meshes.push_back(std::move(mesh));
    return scene.meshes.back();
}

// Facing up, around the origin, `half` metres to each side.
inline SceneMesh& addFloor(Scene& scene, float half, uint32_t material, float height = 0) {
    return addQuad(scene, "floor", {0, height, 0}, {0, 0, half}, {half, 0, 0}, material);
}

// An outward-facing box of `half` metres to each side of its centre.
inline void addSolid(Scene& scene, const char* node, glm::vec3 centre, glm::vec3 half, uint32_t material,
                     std::optional<uint32_t> door = {}) {
    for (int axis = 0; axis < 3; ++axis)
        for (float side : {-1.0f, 1.0f}) {
            glm::vec3 place = centre, u(0), v(0);
            place[axis] += side * half[axis];
            u[(axis + 1) % 3] = half[(axis + 1) % 3];
            v[(axis + 2) % 3] = half[(axis + 2) % 3];
            addQuad(scene, node, place, side > 0 ? u : v, side > 0 ? v : u, material).door = door;
        }
}

// A closed box around the origin that faces inwards.
inline void addBox(Scene& scene, glm::vec3 half, uint32_t material) {
    for (int axis = 0; axis < 3; ++axis)
        for (float side : {-1.0f, 1.0f}) {
            glm::vec3 centre(0), u(0), v(0);
            centre[axis] = side * half[axis];
            u[(axis + 1) % 3] = half[(axis + 1) % 3];
            v[(axis + 2) % 3] = half[(axis + 2) % 3];
            addQuad(scene, "wall", centre, side < 0 ? u : v, side < 0 ? v : u, material);
        }
}

// A latitude-longitude sphere around the origin that faces inwards, unwrapped as it is built (TEXCOORD_1). Returns its
// area, which is a little less than 4 pi r^2.
inline double addSphere(Scene& scene, float radius, uint32_t slices, uint32_t stacks, uint32_t material) {
    SceneMesh mesh;
    mesh.node = "sphere";
    mesh.lighting = Lighting::Lightmap;
    constexpr float pi = std::numbers::pi_v<float>;
    for (uint32_t j = 0; j <= stacks; ++j)
        for (uint32_t i = 0; i <= slices; ++i) {
            const float s = static_cast<float>(i) / static_cast<float>(slices);
            const float t = static_cast<float>(j) / static_cast<float>(stacks);
            // The last column is the first one's place, to the bit: no crack.
            const float phi = 2 * pi * static_cast<float>(i % slices) / static_cast<float>(slices), theta = pi * t;
            const float across = j == 0 || j == stacks ? 0 : std::sin(theta);
            const glm::vec3 outwards(across * std::cos(phi), std::cos(theta), across * std::sin(phi));
            mesh.positions_m.push_back(radius * outwards);
            mesh.normals.push_back(-outwards);
            mesh.uv1.push_back({s, t});
        }
    double area = 0;
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
        const glm::dvec3 ab = mesh.positions_m[b] - mesh.positions_m[a], ac = mesh.positions_m[c] - mesh.positions_m[a];
        area += 0.5 * glm::length(glm::cross(ab, ac));
        const bool inwards = glm::dot(glm::cross(ab, ac), glm::dvec3(mesh.positions_m[a])) < 0;
        mesh.triangles.push_back(inwards ? glm::uvec3(a, b, c) : glm::uvec3(a, c, b));
        mesh.triangle_materials.push_back(material);
    };
    for (uint32_t j = 0; j < stacks; ++j)
        for (uint32_t i = 0; i < slices; ++i) {
            const uint32_t a = j * (slices + 1) + i, b = a + 1, c = a + slices + 1, d = c + 1;
            if (j > 0) add(a, b, c);
            if (j + 1 < stacks) add(b, d, c);
        }
    scene.meshes.push_back(std::move(mesh));
    return area;
}

inline PunctualLight& addPointLight(Scene& scene, glm::vec3 position_m, float candela, BakeMode bake) {
    PunctualLight light;
    light.node = "lamp";
    light.position_m = position_m;
    light.intensity = glm::vec3(candela);
    light.bake = bake;
    scene.lights.push_back(light);
    return scene.lights.back();
}

// A roof of two slopes on a floor, sealed, all facing inwards: eaves at x = -half and half, from z = -length to length.
inline void addAttic(Scene& scene, float half, float length, float slope_rad, uint32_t material) {
    const float ridge = half * std::tan(slope_rad);
    const auto add = [&](const char* node, std::vector<glm::vec3> corners) {
        SceneMesh mesh;
        mesh.node = node;
        mesh.lighting = Lighting::Lightmap;
        const glm::vec3 normal = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
        mesh.normals.assign(corners.size(), normal);
        for (uint32_t i = 2; i < corners.size(); ++i) {
            mesh.triangles.emplace_back(0, i - 1, i);
            mesh.triangle_materials.push_back(material);
        }
        mesh.positions_m = std::move(corners);
        scene.meshes.push_back(std::move(mesh));
    };
    add("floor", {{-half, 0, -length}, {-half, 0, length}, {half, 0, length}, {half, 0, -length}});
    add("west slope", {{-half, 0, -length}, {0, ridge, -length}, {0, ridge, length}, {-half, 0, length}});
    add("east slope", {{half, 0, -length}, {half, 0, length}, {0, ridge, length}, {0, ridge, -length}});
    add("north gable", {{-half, 0, -length}, {half, 0, -length}, {0, ridge, -length}});
    add("south gable", {{half, 0, length}, {-half, 0, length}, {0, ridge, length}});
}

// A corridor of four rooms of 2 m in a row along x, parted by doors that fill it from wall to wall; two light sets and
// a little always-on light.
inline Scene corridorWithDoors() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f)), leaf = addMaterial(scene, lambert(0.8f));
    const uint32_t glow = addMaterial(scene, emissive(glm::vec3(30)));
    addBox(scene, {4, 1, 1}, white);
    scene.doors = {{"a", false}, {"b", false}, {"c", false}};
    for (uint32_t d = 0; d < 3; ++d)
        addSolid(scene, "leaf", {-2 + 2 * static_cast<float>(d), 0, 0}, {0.1f, 1, 1}, leaf, d);
    scene.light_sets = {{"first", 1}, {"third", 1}};
    addPointLight(scene, {-3, 0.2f, 0.1f}, 100, BakeMode::Full).light_set = 0;
    addPointLight(scene, {1, -0.2f, 0.3f}, 100, BakeMode::Indirect).light_set = 1;
    addQuad(scene, "panel", {3, 0.95f, 0}, {0.3f, 0, 0}, {0, 0, 0.3f}, glow);
    return scene;
}

// Share of the hemisphere over a point (cosine-weighted) that a rectangle a x b fills which stands parallel at distance
// c, one corner straight above the point (J. R. Howell, A Catalog of Radiation Heat Transfer Configuration Factors,
// B-3).
inline double cornerFormFactor(double a, double b, double c) {
    const double x = a / c, y = b / c;
    const double xs = std::sqrt(1 + x * x), ys = std::sqrt(1 + y * y);
    return (x / xs * std::atan(y / xs) + y / ys * std::atan(x / ys)) / (2 * std::numbers::pi);
}

}  // namespace dimmer::cook::test
