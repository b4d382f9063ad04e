// The container of a pack, taken apart and put together again with hashes that are right: for tests that want a reader
// to look at bad content rather than at a bad hash.
#pragma once

#include <format/layout.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace dimmer::test {

struct ChunkContent {
    uint32_t type = 0, flags = 0, subject = 0, shuffle = 1;
    std::vector<std::byte> bytes;  // decompressed, added up and unshuffled
    // What the table says of the size; empty: the truth.
    uint64_t claimed_bytes = UINT64_MAX;
    // Used in place of the compressed bytes when not empty.
    std::vector<std::byte> stored;

    template <class T>
    T read(size_t offset) const;
    template <class T>
    void write(size_t offset, T value);
};

class PackFile {
   public:
    format::Header header{};
    std::vector<ChunkContent> chunks;

    explicit PackFile(std::span<const std::byte> file);
    std::vector<std::byte> bytes() const;
    ChunkContent& chunk(const char (&type)[5], uint32_t subject = 0);
};

template <class T>
T ChunkContent::read(size_t offset) const {
    T value;
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset), sizeof(T), reinterpret_cast<std::byte*>(&value));
    return value;
}

template <class T>
void ChunkContent::write(size_t offset, T value) {
    if (bytes.size() < offset + sizeof(T)) bytes.resize(offset + sizeof(T));
    std::copy_n(reinterpret_cast<const std::byte*>(&value), sizeof(T),
                bytes.begin() + static_cast<std::ptrdiff_t>(offset));
}

std::string typeName(uint32_t type);

}  // namespace dimmer::test
