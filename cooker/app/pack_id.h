// What tells a pack's reports from another's.
#pragma once

#include <filesystem>
#include <string>

namespace dimmer::cook {

// The hash in the file's header, which covers those of all chunks, in hexadecimal: as `cook --json` and `verify --json`
// name the pack that they are of. Empty where there is no header to be read.
std::string packId(const std::filesystem::path& pack);

}  // namespace dimmer::cook
