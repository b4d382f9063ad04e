// What a pack is made from, for build systems.
#pragma once

#include <app/files.h>

#include <filesystem>
#include <string>
#include <vector>

namespace dimmer::cook {

// Those of the inputs that are there, each once: a level may name files that nothing reads.
std::vector<std::filesystem::path> filesThere(const std::vector<NamedFile>& inputs);

// "pack: level.gltf level.bin" in Make's syntax, as Ninja reads it too. An error where a name cannot be written in it.
Expected<std::string> depfileText(const std::filesystem::path& pack, const std::vector<std::filesystem::path>& inputs);

}  // namespace dimmer::cook
