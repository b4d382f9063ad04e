// From bytes to a parsed glTF document. Nothing in the result can be trusted yet but its types: see gltf_check.h.
#pragma once

#include <dimmer/error.h>
#include <tiny_gltf.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// A whole file of at most 2 GiB. Errors name it.
Expected<std::vector<unsigned char>> readFile(const std::filesystem::path& path);

// Reads .glb or .gltf (told apart by content) with its buffers. Images stay encoded: bytes of external and data-URI
// images in tinygltf::Image::image (empty when unreadable), others in their buffer view.
struct GltfSource {
    std::string json;  // as it stands in the file, with what the parser does not know
    tinygltf::Model model;
};
Expected<GltfSource> readGltfSource(const std::filesystem::path& path);

// Per node, whether an animation moves, turns or scales it. The model has no animations.
std::vector<bool> animatedNodes(std::string_view gltf_json, size_t nodes);

}  // namespace dimmer::cook
