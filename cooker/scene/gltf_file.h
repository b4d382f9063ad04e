// From bytes to a parsed glTF document. Nothing in the result can be trusted yet but its types: see gltf_check.h.
#pragma once

#include <dimmer/error.h>
#include <tiny_gltf.h>

#include <filesystem>
#include <string>
#include <vector>

namespace dimmer::cook {

// A whole file of at most 2 GiB. Errors name it.
Expected<std::vector<unsigned char>> readFile(const std::filesystem::path& path);

// Reads .glb or .gltf (told apart by content) with its buffers. Images stay encoded: bytes of external and data-URI
// images in tinygltf::Image::image (empty when unreadable), others in their buffer view.
Expected<tinygltf::Model> readGltf(const std::filesystem::path& path);

// The same, with the JSON as it stands in the file: for writing it again without losing what the parser does not know.
struct GltfSource {
    std::string json;
    tinygltf::Model model;
};
Expected<GltfSource> readGltfSource(const std::filesystem::path& path);

}  // namespace dimmer::cook
