// PNG pictures of 8 bits a channel.
#pragma once

#include <dimmer/error.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// `channels`: 1 (grey), 3 (RGB) or 4 (RGBA); rows from the top. The same pixels give the same bytes.
Expected<std::vector<std::byte>> pngBytes(uint32_t width, uint32_t height, uint32_t channels,
                                          std::span<const uint8_t> pixels);

}  // namespace dimmer::cook
