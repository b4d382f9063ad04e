// A small valid pack that holds one of everything.
#pragma once

#include <runtime/random_pack.h>

namespace dimmer::test {

inline Mesh squareMesh(std::string node, float y_m) {
    Mesh mesh;
    mesh.node = std::move(node);
    mesh.reflectance = {0.5f, 0.25f, 0.125f};
    for (const auto& [x, z] : {std::pair{0.0f, 0.0f}, {0.0f, 1.0f}, {1.0f, 1.0f}, {1.0f, 0.0f}})
        mesh.vertices.push_back({{x, y_m, z}, {0, 1, 0}, {0.1f + 0.5f * x, 0.1f + 0.5f * z}});
    mesh.indices = {0, 1, 2, 0, 2, 3};
    return mesh;
}

// Triangles in the order and with the first corners that the index codec leaves as they are.
inline ModelMesh leafMesh(std::string name) {
    ModelMesh mesh;
    mesh.name = std::move(name);
    mesh.min_m = {-1, 0, -0.5f};
    mesh.max_m = {1, 2, 0.5f};
    mesh.reflectance = {0.1f, 0.2f, 0.3f};
    mesh.emission_cd_m2 = {1, 2, 3};
    mesh.emission_set = 1;
    for (uint16_t i = 0; i < 5; ++i)
        mesh.vertices.push_back({{static_cast<uint16_t>(65535 * (i & 1)), static_cast<uint16_t>(13000 * i), 7},
                                 {static_cast<int16_t>(-6000 * i), 32767},
                                 {127, -127, static_cast<int8_t>(i), 3, 4, 5, 6, 7, -8}});
    mesh.indices = {0, 1, 2, 2, 1, 3, 2, 3, 4};
    return mesh;
}

// 4 sets and 2 doors on 2 pages of 32 x 32; clusters of 1 to 150 receivers, so some batches are full and some are not.
inline PackData samplePack(uint32_t seed = 1) {
    PackData data =
        randomPack(seed, {.sets = 4, .doors = 2, .clusters = 12, .overlap_max = 5, .page_count = 2, .page_side = 32});
    const uint32_t door = 4;
    Mesh floor = squareMesh("floor", 0), leaf = squareMesh("leaf", 1);
    leaf.page = 1;
    leaf.door = door;
    leaf.emission_cd_m2 = {10, 20, 30};
    leaf.emission_set = 2;
    data.meshes = {std::move(floor), std::move(leaf)};
    data.viewpoints = {{"player_start", {1, 2, 3}, {0, 0, -1}, 1.1f}, {"camera", {4, 5, 6}, {1, 0, 0}, 0.7f}};
    data.model_meshes = {leafMesh("barrel"), leafMesh("lid")};
    data.models.resize(2);
    data.models[0].node = "barrel_place";
    PlacedModel& barrel = data.models[1];
    barrel.node = "barrel";
    barrel.mesh_count = 2;
    barrel.world_from_model.rows = {{{0, 0, 1, 4}, {0, 1, 0, 5}, {-1, 0, 0, 6}}};
    barrel.min_m = {-1, 0, -0.5f};
    barrel.max_m = {1, 2, 0.5f};
    data.contributions[1].energy_dropped = 0.25f;
    data.settings_json = R"({"quality": {"value": "draft", "from": "command line"}})";
    return data;
}

}  // namespace dimmer::test
