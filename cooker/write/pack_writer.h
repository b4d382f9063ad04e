// PackData to bytes and to a file.
#pragma once

#include <pack/pack_data.h>

#include <cstddef>
#include <filesystem>
#include <mutex>
#include <span>
#include <vector>

namespace dimmer::cook {

// The same data and level give the same bytes. `zstd_level`: 1..19; what reads the pack need not know.
std::vector<std::byte> packBytes(const PackData& data, int zstd_level = 12);

// The file that a link, or a link to a link, stands for, be it there or not; a path that is no link as it is.
Expected<std::filesystem::path> behindLinks(const std::filesystem::path& path);

// Whether writeFileAtomically() can be expected to work; asked before hours of work, not after.
Expected<void> checkWritable(const std::filesystem::path& path);

// Held while writeFileAtomically() has a temporary file: who ends the process from another thread takes it first.
std::mutex& fileReplacement();

// Whether a file has to survive a power cut right after it was written.
enum class Flush { Yes, No };

// Writes a temporary file beside `path`, flushes it, and renames it: `path` is either as before or complete, with
// owner, group and rights that it had, as far as one may give these. Links are followed; devices and pipes are written
// to directly. What is read-only is an error.
Expected<void> writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes,
                                   Flush flush = Flush::Yes);

}  // namespace dimmer::cook
