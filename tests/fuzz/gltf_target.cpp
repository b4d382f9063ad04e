#include <fuzz/input_file.h>
#include <fuzz/target.h>
#include <scene/full_level.h>

#include <algorithm>
#include <cmath>

namespace dimmer::fuzz {
namespace {

using cook::Scene;
using cook::SceneMesh;

bool finite(const std::vector<glm::vec3>& values) {
    return std::ranges::all_of(
        values, [](glm::vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); });
}

// What the charts and the bake rely on.
void checkMesh(const Scene& scene, const SceneMesh& mesh) {
    require(mesh.normals.size() == mesh.positions_m.size(), "a normal per position");
    require(mesh.uv0.empty() || mesh.uv0.size() == mesh.positions_m.size(), "no texture coordinates or one each");
    require(mesh.uv1.empty() || mesh.uv1.size() == mesh.positions_m.size(), "no lightmap coordinates or one each");
    require(finite(mesh.positions_m) && finite(mesh.normals), "positions and normals are finite");
    require(mesh.triangle_materials.size() == mesh.triangles.size(), "a material per triangle");
    for (const glm::uvec3& t : mesh.triangles)
        require(std::max({t.x, t.y, t.z}) < mesh.positions_m.size(), "corners are vertices");
    for (const uint32_t m : mesh.triangle_materials) require(m < scene.materials.size(), "materials are there");
    require(!mesh.door || *mesh.door < scene.doors.size(), "the door is there");
    require(!mesh.light_set || *mesh.light_set < scene.light_sets.size(), "the light set is there");
}

void checkScene(const Scene& scene) {
    for (const SceneMesh& mesh : scene.meshes) checkMesh(scene, mesh);
    for (const cook::PunctualLight& light : scene.lights) {
        require(finite({light.position_m, light.direction, light.intensity}), "lights are finite");
        require(!light.light_set || *light.light_set < scene.light_sets.size(), "a light's set is there");
    }
    for (const cook::Material& m : scene.materials) {
        require(finite({m.base_color, m.emission_cd_m2}), "materials are finite");
        require(!m.base_color_texture || *m.base_color_texture < scene.textures.size(), "a material's image is there");
    }
    for (const auto& texture : scene.textures)
        require(texture->texels.size() == size_t{texture->width} * texture->height, "a texture holds its texels");
    for (const auto& combination : scene.combinations)
        for (const cook::ElementRef& e : combination)
            require(e.index < (e.is_door ? scene.doors.size() : scene.light_sets.size()),
                    "combined elements are there");
}

// What the full level has not: a texture with a transform, a measured luminaire, a camera, a spot, a matrix, a door's
// pose and quantized attributes.
cook::test::LevelFile rareLevel() {
    using nlohmann::json;
    cook::test::LevelFile level = cook::test::fullLevel();
    json& d = level.document;
    d["images"] =
        json::array({{{"uri",
                       "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8/5+hHgAHggJ/"
                       "PchI7wAAAABJRU5ErkJggg=="}}});
    d["textures"] = json::array({{{"source", 0}}});
    d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {
        {"index", 0}, {"extensions", {{"KHR_texture_transform", {{"offset", {0.25, 0.5}}, {"rotation", 0.5}}}}}};
    d["materials"][0]["alphaMode"] = "MASK";
    level.primitive(0)["attributes"]["TEXCOORD_0"] = level.addVec2({{0, 0}, {0, 1}, {1, 1}, {1, 0}});
    d["extensionsUsed"] = {"KHR_texture_transform", "EXT_lights_ies", "KHR_mesh_quantization"};
    const std::string ies = "TILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 20\n0 90\n0\n100 10\n";
    d["extensions"]["EXT_lights_ies"]["lights"] =
        json::array({{{"bufferView", level.addView(ies.data(), ies.size())}, {"mimeType", "application/x-ies-lm-63"}}});
    level.addNode({{"name", "tube"},
                   {"extensions", {{"EXT_lights_ies", {{"light", 0}, {"multiplier", 2}, {"color", {1, 0.5, 1}}}}}},
                   {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 2, 0, 1}}});
    d["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.1}}}}});
    level.addNode({{"name", "view"}, {"camera", 0}, {"rotation", {0, 0.6, 0, 0.8}}});
    d["nodes"][2]["extras"].update({{"dimmer_door_open", "pose"}, {"dimmer_door_translation", {0, 2, 0}}});
    const std::vector<int16_t> corners = {0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0};  // three of four, each padded to 8 bytes
    const int view = level.addView(corners.data(), 24);
    d["bufferViews"][static_cast<size_t>(view)]["byteStride"] = 8;
    const int positions = level.addAccessor(view, 5122, 3, "VEC3");
    d["meshes"].push_back({{"primitives", json::array({{{"attributes", {{"POSITION", positions}}}, {"mode", 5}}})}});
    level.addNode({{"name", "quantized"}, {"mesh", d["meshes"].size() - 1}});
    return level;
}

}  // namespace

void runGltf(Input input) {
    static const InputFile file("level.gltf");
    file.write(input);
    const auto scene = cook::importLevel(file.path());
    if (scene)
        checkScene(*scene);
    else
        require(scene.error().message.find("level.gltf") != std::string::npos, "an error names the file");
}

std::vector<Bytes> gltfSeeds() {
    const cook::test::LevelFile full = cook::test::fullLevel(), floor = cook::test::LevelFile::withFloor();
    const cook::test::LevelFile rare = rareLevel();
    const auto imported = rare.import();
    require(imported.has_value() && imported->textures.size() == 1, "the rare seed is a level");
    cook::test::LevelFile boasting = rare;  // its picture's header claims 8192 x 8192 texels
    std::string picture = boasting.document["images"][0]["uri"];
    constexpr std::string_view size = "AAAAEAAAABCAYA";
    picture.replace(picture.find(size), size.size(), "AAIAAAACAACAYA");
    boasting.document["images"][0]["uri"] = picture;
    cook::test::LevelFile endless = rare;  // a chunk of its picture claims 604 MB
    picture = endless.document["images"][0]["uri"];
    constexpr std::string_view chunk = "FcSJAAAADUlEQVR4";
    picture.replace(picture.find(chunk), chunk.size(), "FcSJJAAADUlEQVR4");
    endless.document["images"][0]["uri"] = picture;
    return {full.glb(),
            bytesOf(full.gltfText()),
            floor.glb(),
            bytesOf(floor.gltfText()),
            rare.glb(),
            bytesOf(rare.gltfText()),
            bytesOf(boasting.gltfText()),
            bytesOf(endless.gltfText())};
}

}  // namespace dimmer::fuzz
