// What tells a pack's reports from another's.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace dimmer::cook {

// The hash in the file's header, which covers those of all chunks, in hexadecimal: as `cook --json` and `verify --json`
// name the pack that they are of. Empty where there is no header to be read.
std::string packId(const std::filesystem::path& pack);
// Of a pack whose hash is known: what was written to a pipe is not there to be read again.
std::string packId(uint64_t header_hash);

}  // namespace dimmer::cook
