// Meshes of models as bytes: meshoptimizer's codecs, of which a pack uses version 0 for vertices and 1 for indices.
#pragma once

#include <dimmer/model_mesh.h>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace dimmer {

// Empty where the bytes are not what an encoder makes of so many items. Never reads past them, and allocates no more
// than 64 times their number (and 16 KiB).
std::optional<std::vector<ModelVertex>> decodeVertices(uint32_t count, std::span<const std::byte> bytes);
std::optional<std::vector<uint32_t>> decodeIndices(uint32_t count, std::span<const std::byte> bytes);

}  // namespace dimmer
