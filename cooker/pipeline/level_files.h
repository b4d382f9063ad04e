// What a level is made of besides its own file.
#pragma once

#include <filesystem>
#include <vector>

namespace dimmer::cook {

// Every file that a .gltf or .glb names, be it there and used or not: buffers, images, light profiles, the sky. None
// where the level cannot be read: the import says why.
std::vector<std::filesystem::path> filesNamedBy(const std::filesystem::path& level);

}  // namespace dimmer::cook
