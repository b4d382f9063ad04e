#include <fmt/format.h>
#include <gtest/gtest.h>
#include <scene/level_file.h>
#include <unistd.h>

#include <atomic>
#include <fstream>

namespace dimmer::cook::test {
namespace {

constexpr int float_type = 5126, uint32_type = 5125;

std::string base64(const std::vector<uint8_t>& bytes) {
    constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        const size_t left = bytes.size() - i;
        const uint32_t group =
            uint32_t{bytes[i]} << 16 | (left > 1 ? uint32_t{bytes[i + 1]} << 8 : 0) | (left > 2 ? bytes[i + 2] : 0);
        text += digits[group >> 18];
        text += digits[group >> 12 & 63];
        text += left > 1 ? digits[group >> 6 & 63] : '=';
        text += left > 2 ? digits[group & 63] : '=';
    }
    return text;
}

void append32(std::vector<uint8_t>& bytes, size_t value) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<uint8_t>(value >> shift));
}

}  // namespace

LevelFile::LevelFile() {
    document = json::parse(R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": []})");
}

LevelFile LevelFile::withFloor() {
    LevelFile level;
    const int white =
        level.addMaterial({{"name", "white"},
                           {"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.8, 0.8, 1}}, {"metallicFactor", 0}}}});
    const int mesh = level.addMesh({{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}}, std::vector(4, glm::vec3(0, 1, 0)),
                                   {0, 1, 2, 0, 2, 3}, white);
    level.addNode({{"name", "floor"}, {"mesh", mesh}});
    return level;
}

int LevelFile::addView(const void* data, size_t bytes) {
    while (buffer.size() % 4 != 0) buffer.push_back(0);
    document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes}});
    const auto* first = static_cast<const uint8_t*>(data);
    buffer.insert(buffer.end(), first, first + bytes);
    return static_cast<int>(document["bufferViews"].size()) - 1;
}

int LevelFile::addAccessor(int view, int component_type, size_t count, const char* type) {
    document["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component_type}, {"count", count}, {"type", type}});
    return static_cast<int>(document["accessors"].size()) - 1;
}

int LevelFile::addVec3(const std::vector<glm::vec3>& values) {
    return addAccessor(addView(values.data(), values.size() * sizeof(glm::vec3)), float_type, values.size(), "VEC3");
}

int LevelFile::addVec2(const std::vector<glm::vec2>& values) {
    return addAccessor(addView(values.data(), values.size() * sizeof(glm::vec2)), float_type, values.size(), "VEC2");
}

int LevelFile::addIndices(const std::vector<uint32_t>& values) {
    return addAccessor(addView(values.data(), values.size() * 4), uint32_type, values.size(), "SCALAR");
}

int LevelFile::addMaterial(const json& material) {
    document["materials"].push_back(material);
    return static_cast<int>(document["materials"].size()) - 1;
}

int LevelFile::addMesh(const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>& normals,
                       const std::vector<uint32_t>& indices, int material) {
    json primitive = {{"attributes", {{"POSITION", addVec3(positions)}}}};
    if (!normals.empty()) primitive["attributes"]["NORMAL"] = addVec3(normals);
    if (!indices.empty()) primitive["indices"] = addIndices(indices);
    if (material >= 0) primitive["material"] = material;
    document["meshes"].push_back({{"primitives", json::array({primitive})}});
    return static_cast<int>(document["meshes"].size()) - 1;
}

int LevelFile::addSquareMesh(int material) {
    return addMesh({{-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0}, {-0.5f, 0.5f, 0}},
                   std::vector(4, glm::vec3(0, 0, 1)), {0, 1, 2, 0, 2, 3}, material);
}

int LevelFile::addNode(const json& new_node, int parent) {
    document["nodes"].push_back(new_node);
    const int index = static_cast<int>(document["nodes"].size()) - 1;
    (parent < 0 ? document["scenes"][0]["nodes"] : node(parent)["children"]).push_back(index);
    return index;
}

int LevelFile::addLight(const std::string& node_name, const json& light, const json& extras) {
    json& lights = document["extensions"]["KHR_lights_punctual"]["lights"];
    lights.push_back(light);
    json carrier = {{"name", node_name}, {"extensions", {{"KHR_lights_punctual", {{"light", lights.size() - 1}}}}}};
    if (!extras.empty()) carrier["extras"] = extras;
    return addNode(carrier);
}

std::string LevelFile::gltfText() const {
    json text = document;
    if (!buffer.empty() && !text.contains("buffers"))
        text["buffers"] = json::array(
            {{{"byteLength", buffer.size()}, {"uri", "data:application/octet-stream;base64," + base64(buffer)}}});
    return text.dump();
}

std::vector<uint8_t> LevelFile::glb() const {
    json header = document;
    if (!header.contains("buffers")) header["buffers"] = json::array({{{"byteLength", buffer.size()}}});
    std::string text = header.dump();
    while (text.size() % 4 != 0) text += ' ';
    std::vector<uint8_t> data = buffer;
    while (data.size() % 4 != 0) data.push_back(0);
    std::vector<uint8_t> bytes = {'g', 'l', 'T', 'F'};
    append32(bytes, 2);
    append32(bytes, 12 + 8 + text.size() + 8 + data.size());
    append32(bytes, text.size());
    append32(bytes, 0x4E4F534A);
    bytes.insert(bytes.end(), text.begin(), text.end());
    append32(bytes, data.size());
    append32(bytes, 0x004E4942);
    bytes.insert(bytes.end(), data.begin(), data.end());
    return bytes;
}

Expected<Scene> LevelFile::import() const {
    const std::string text = gltfText();
    return importBytes("level.gltf", std::vector<uint8_t>(text.begin(), text.end()));
}

Expected<Scene> LevelFile::importGlb() const {
    return importBytes("level.glb", glb());
}

TemporaryFolder::TemporaryFolder() {
    static std::atomic<int> count = 0;
    path = std::filesystem::temp_directory_path() / fmt::format("dimmer_scene_{}_{}", getpid(), count++);
    std::filesystem::create_directories(path);
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
}

std::filesystem::path TemporaryFolder::write(const std::string& name, const void* data, size_t bytes) const {
    const std::filesystem::path file = path / name;
    std::ofstream(file, std::ios::binary).write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
    return file;
}

Expected<Scene> importBytes(const std::string& name, const std::vector<uint8_t>& bytes) {
    const TemporaryFolder folder;
    return importLevel(folder.write(name, bytes.data(), bytes.size()));
}

}  // namespace dimmer::cook::test
