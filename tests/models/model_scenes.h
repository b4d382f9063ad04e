// Scenes with models that light grids light, and a whole bake of them in memory.
#pragma once

#include <bake/baked_scene.h>
#include <bake/test_scenes.h>
#include <models/scene_models.h>

#include <glm/gtc/matrix_transform.hpp>

namespace dimmer::cook::test {

// A closed box of six sides that face outwards, `half` metres to each side of its node.
inline SceneMesh& addCrate(Scene& scene, const char* node, const glm::dmat4& world_from_node, glm::vec3 half,
                           uint32_t material, Lighting lighting = Lighting::LocalGrid) {
    SceneMesh mesh;
    mesh.node = node;
    mesh.lighting = lighting;
    mesh.world_from_node = world_from_node;
    for (int axis = 0; axis < 3; ++axis)
        for (const float side : {-1.0f, 1.0f}) {
            glm::vec3 normal(0), u(0), v(0);
            normal[axis] = side;
            u[(axis + 1) % 3] = side;
            v[(axis + 2) % 3] = 1;
            const auto first = static_cast<uint32_t>(mesh.positions_m.size());
            for (const glm::vec2 corner : {glm::vec2(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
                const glm::vec3 p = half * (normal + corner.x * u + corner.y * v);
                mesh.positions_m.emplace_back(world_from_node * glm::dvec4(p, 1));
                mesh.normals.emplace_back(
                    glm::normalize(glm::transpose(glm::inverse(glm::dmat3(world_from_node))) * glm::dvec3(normal)));
            }
            mesh.triangles.push_back({first, first + 1, first + 2});
            mesh.triangles.push_back({first, first + 2, first + 3});
            mesh.triangle_materials.insert(mesh.triangle_materials.end(), 2, material);
        }
    scene.meshes.push_back(std::move(mesh));
    return scene.meshes.back();
}

inline glm::dmat4 placed(glm::dvec3 at, double turn_rad = 0, glm::dvec3 axis = {0, 1, 0}) {
    return glm::rotate(glm::translate(glm::dmat4(1), at), turn_rad, axis);
}

// Three nodes of one mesh: "first", "turned" and, 1.5 times the size, "larger".
inline Scene crateInstances() {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    const auto add = [&](const char* node, const glm::dmat4& at) {
        SceneMesh& mesh = addCrate(scene, node, at, {0.5f, 0.3f, 0.2f}, grey);
        mesh.gltf_mesh = 7;
        mesh.gltf_node = static_cast<int>(scene.meshes.size());
    };
    add("first", placed({0, 0, 0}));
    add("turned", placed({5, 1, 0}, 1.2, {0.6, 0.8, 0}));
    add("larger", glm::scale(placed({9, 0, 0}), glm::dvec3(1.5)));
    return scene;
}

}  // namespace dimmer::cook::test
