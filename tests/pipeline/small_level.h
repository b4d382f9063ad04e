// Levels that cook in a fraction of a second.
#pragma once

#include <bake/progress.h>
#include <gtest/gtest.h>
#include <pipeline/cook.h>
#include <scene/level_file.h>

namespace dimmer::cook::test {

inline int addWhite(LevelFile& level, const json& extra = json::object()) {
    json material = {{"pbrMetallicRoughness", {{"baseColorFactor", {0.7, 0.7, 0.7, 1}}, {"metallicFactor", 0}}}};
    material.update(extra);
    return level.addMaterial(material);
}

// Six inward-facing squares: a closed room of `size_m` a side with its corner at `corner`.
inline int addRoomMesh(LevelFile& level, glm::vec3 corner, float size_m, int material) {
    std::vector<glm::vec3> positions, normals;
    std::vector<uint32_t> indices;
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            const auto first = static_cast<uint32_t>(positions.size());
            glm::vec3 u(0), v(0), normal(0);
            u[(axis + 1) % 3] = size_m;
            v[(axis + 2) % 3] = size_m;  // u x v points along +axis
            normal[axis] = side == 0 ? 1.0f : -1.0f;
            glm::vec3 origin = corner;
            origin[axis] += side == 0 ? 0.0f : size_m;
            for (const glm::vec3& p : {origin, origin + u, origin + u + v, origin + v}) {
                positions.push_back(p);
                normals.push_back(normal);
            }
            if (side == 0)
                for (uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) indices.push_back(first + i);
            else
                for (uint32_t i : {0u, 2u, 1u, 0u, 3u, 2u}) indices.push_back(first + i);
        }
    return level.addMesh(positions, normals, indices, material);
}

// Two closed rooms of 2 m, 6 m apart: sets "one" and "both" light the first, "two" and "both" the second.
inline LevelFile twoCells() {
    LevelFile level;
    const int white = addWhite(level);
    level.addNode({{"name", "cell1"}, {"mesh", addRoomMesh(level, {0, 0, 0}, 2, white)}});
    level.addNode({{"name", "cell2"}, {"mesh", addRoomMesh(level, {8, 0, 0}, 2, white)}});
    const json lamp = {{"type", "point"}, {"intensity", 100}};
    auto add = [&](const char* node, const char* set, glm::vec3 p) {
        const int index = level.addLight(node, lamp, {{"dimmer_light_set", set}, {"dimmer_bake", "full"}});
        level.node(index)["translation"] = {p.x, p.y, p.z};
    };
    add("lamp1", "one", {0.6f, 1.2f, 0.7f});
    add("lamp2", "both", {1.3f, 0.8f, 1.1f});
    add("lamp3", "two", {8.5f, 1.2f, 0.7f});
    add("lamp4", "both", {9.3f, 0.8f, 1.1f});
    level.document["scenes"][0]["extras"] = {{"dimmer_sky_color", {1, 1, 1}}, {"dimmer_sky_luminance", 5}};
    return level;
}

// The coarsest profile that still has every part.
inline Profile smallProfile() {
    auto profile = loadProfile("desktop");
    EXPECT_TRUE(profile) << profile.error().message;
    profile->draft = {
        .samples_per_texel = 2, .series_rays = 8, .rays = 16, .emitter_samples = 2, .bounces = 8, .tolerance = 0.05f};
    return *profile;
}

inline Expected<PackData> cookLevel(const LevelFile& level, const Profile& profile = smallProfile()) {
    auto scene = level.import();
    if (!scene) return std::unexpected(scene.error());
    SilentProgress silent;
    CookStats stats;
    return cookScene(std::move(*scene), profile, "draft", silent, stats);
}

// The level as a file of `folder`.
inline std::filesystem::path writeLevel(const TemporaryFolder& folder, const LevelFile& level,
                                        const std::string& name = "level.gltf") {
    const std::string text = level.gltfText();
    return folder.write(name, text.data(), text.size());
}

inline std::filesystem::path writeText(const TemporaryFolder& folder, const std::string& name,
                                       const std::string& text) {
    return folder.write(name, text.data(), text.size());
}

}  // namespace dimmer::cook::test
