// A small glTF level, built by a test: JSON that the test may edit freely, and one buffer.
#pragma once

#include <scene/scene.h>

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace dimmer::cook::test {

using nlohmann::json;

class LevelFile {
   public:
    json document;
    std::vector<uint8_t> buffer;

    // An empty scene.
    LevelFile();

    // A scene with one node "floor": a square of 2 x 2 m at y = 0, facing +Y, in a plain white material.
    static LevelFile withFloor();

    int addView(const void* data, size_t bytes);
    int addAccessor(int view, int component_type, size_t count, const char* type);
    int addVec3(const std::vector<glm::vec3>& values);
    int addVec2(const std::vector<glm::vec2>& values);
    int addIndices(const std::vector<uint32_t>& values);
    int addMaterial(const json& material);
    // A mesh of one primitive; normals may be empty.
    int addMesh(const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>& normals,
                const std::vector<uint32_t>& indices, int material);
    // The unit square in the XY plane around the origin, facing +Z.
    int addSquareMesh(int material);
    // Adds a node to the scene's roots (or to a parent's children) and returns its index.
    int addNode(const json& node, int parent = -1);
    // Adds a light to the document and a node that carries it.
    int addLight(const std::string& node_name, const json& light, const json& extras = json::object());

    json& node(int index) { return document["nodes"][static_cast<size_t>(index)]; }
    json& primitive(int mesh, int index = 0) {
        return document["meshes"][static_cast<size_t>(mesh)]["primitives"][static_cast<size_t>(index)];
    }

    std::string gltfText() const;  // with the buffer as a data URI
    std::vector<uint8_t> glb() const;

    Expected<Scene> import() const;
    Expected<Scene> importGlb() const;
};

// A folder of this test's own below the system's temporary one; removed at the end.
class TemporaryFolder {
   public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    std::filesystem::path write(const std::string& name, const void* data, size_t bytes) const;
    std::filesystem::path path;
};

// Writes the bytes to a file of the given name and imports it.
Expected<Scene> importBytes(const std::string& name, const std::vector<uint8_t>& bytes);

}  // namespace dimmer::cook::test
