#pragma once

#include <dimmer/error.h>

#include <cstdint>
#include <filesystem>
#include <span>

namespace dimmer::sample {

// 8-bit RGB, rows from the top.
Expected<void> writePng(const std::filesystem::path& path, uint32_t width, uint32_t height,
                        std::span<const uint8_t> rgb);

}  // namespace dimmer::sample
