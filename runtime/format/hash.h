// Hashes of a pack's parts, the same for writer and reader.
#pragma once

#include <format/layout.h>

#include <xxhash.h>

#include <cstring>
#include <span>
#include <vector>

namespace dimmer::format {

inline uint64_t chunkHash(std::span<const std::byte> stored) {
    return XXH64(stored.data(), stored.size(), 0);
}

// Over the header, its own hash taken as 0, and the chunk table.
inline uint64_t headerHash(Header header, std::span<const std::byte> table) {
    header.xxh64 = 0;
    std::vector<std::byte> bytes(sizeof(header) + table.size());
    std::memcpy(bytes.data(), &header, sizeof(header));
    if (!table.empty()) std::memcpy(bytes.data() + sizeof(header), table.data(), table.size());
    return chunkHash(bytes);
}

}  // namespace dimmer::format
