// Decompression that never gets ahead of its input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace dimmer {

// Decodes one zstd frame of exactly `real_bytes`. Memory grows with what has really been decoded, so a frame that
// only claims to be large costs little. Empty when the frame is damaged or of another size.
std::optional<std::vector<std::byte>> decompress(std::span<const std::byte> stored, uint64_t real_bytes);

}  // namespace dimmer
