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
        require(!m.base_color_image || *m.base_color_image < scene.images.size(), "a material's image is there");
    }
    for (const cook::Image& image : scene.images)
        require(image.texels.size() == size_t{image.width} * image.height, "an image holds its texels");
    for (const auto& combination : scene.combinations)
        for (const cook::ElementRef& e : combination)
            require(e.index < (e.is_door ? scene.doors.size() : scene.light_sets.size()),
                    "combined elements are there");
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
    return {full.glb(), bytesOf(full.gltfText()), floor.glb(), bytesOf(floor.gltfText())};
}

}  // namespace dimmer::fuzz
