// PackData to bytes and to a file.
#pragma once

#include <pack/pack_data.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace dimmer::cook {

// The same data gives the same bytes.
std::vector<std::byte> packBytes(const PackData& data);

// Writes a temporary file beside `path`, flushes it, and renames it: `path` is either as before or complete.
Expected<void> writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace dimmer::cook
