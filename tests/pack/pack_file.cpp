#include <gtest/gtest.h>
#include <pack/pack_file.h>
#include <xxhash.h>
#include <zstd.h>

#include <cstring>

namespace dimmer::test {
namespace {

std::vector<std::byte> shuffle(const std::vector<std::byte>& bytes, size_t record, bool undo) {
    if (record <= 1 || bytes.size() % record != 0) return bytes;
    std::vector<std::byte> out(bytes.size());
    const size_t count = bytes.size() / record;
    for (size_t i = 0; i < bytes.size(); ++i) {
        const size_t planar = i % record * count + i / record;
        if (undo)
            out[i] = bytes[planar];
        else
            out[planar] = bytes[i];
    }
    return out;
}

// Differences of neighbours within each of the shuffle's groups, or back.
std::vector<std::byte> differences(std::vector<std::byte> bytes, size_t record, bool undo) {
    if (bytes.size() % record != 0) return bytes;
    const size_t count = bytes.size() / record;
    uint8_t before = 0;
    for (size_t i = 0; i < bytes.size(); ++i) {
        if (i % count == 0) before = 0;
        const auto byte = std::to_integer<uint8_t>(bytes[i]);
        const auto other = static_cast<uint8_t>(undo ? byte + before : byte - before);
        bytes[i] = std::byte(other);
        before = undo ? other : byte;
    }
    return bytes;
}

std::vector<std::byte> inFile(const ChunkContent& c) {
    auto bytes = shuffle(c.bytes, c.shuffle, false);
    return c.flags & format::chunk_delta ? differences(std::move(bytes), c.shuffle, false) : bytes;
}

std::vector<std::byte> compress(const std::vector<std::byte>& bytes) {
    std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
    out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 1));
    return out;
}

}  // namespace

std::string typeName(uint32_t type) {
    std::string name(4, ' ');
    std::memcpy(name.data(), &type, 4);
    return name;
}

PackFile::PackFile(std::span<const std::byte> file) {
    std::memcpy(&header, file.data(), sizeof(header));
    for (uint32_t i = 0; i < header.chunk_count; ++i) {
        format::Chunk c;
        std::memcpy(&c, file.data() + sizeof(header) + i * sizeof(c), sizeof(c));
        std::vector<std::byte> raw(c.real_bytes);
        EXPECT_EQ(ZSTD_decompress(raw.data(), raw.size(), file.data() + c.offset, c.stored_bytes), c.real_bytes);
        if (c.flags & format::chunk_delta) raw = differences(std::move(raw), c.shuffle, true);
        chunks.push_back({c.type, c.flags, c.subject, c.shuffle, shuffle(raw, c.shuffle, true), UINT64_MAX, {}});
    }
}

std::vector<std::byte> PackFile::bytes() const {
    std::vector<format::Chunk> table;
    std::vector<std::byte> body;
    const size_t body_start = (sizeof(header) + chunks.size() * sizeof(format::Chunk) + 63) / 64 * 64;
    for (const ChunkContent& c : chunks) {
        const auto stored = c.stored.empty() ? compress(inFile(c)) : c.stored;
        table.push_back({c.type, c.flags, c.subject, c.shuffle, body_start + body.size(), stored.size(),
                         c.claimed_bytes == UINT64_MAX ? c.bytes.size() : c.claimed_bytes,
                         XXH64(stored.data(), stored.size(), 0)});
        body.insert(body.end(), stored.begin(), stored.end());
        body.resize((body.size() + 63) / 64 * 64);
    }
    format::Header h = header;
    h.chunk_count = static_cast<uint32_t>(chunks.size());
    h.file_bytes = body_start + body.size();
    h.xxh64 = 0;
    std::vector<std::byte> file(body_start);
    std::memcpy(file.data(), &h, sizeof(h));
    if (!table.empty()) std::memcpy(file.data() + sizeof(h), table.data(), table.size() * sizeof(table[0]));
    h.xxh64 = XXH64(file.data(), sizeof(h) + table.size() * sizeof(format::Chunk), 0);
    std::memcpy(file.data(), &h, sizeof(h));
    file.insert(file.end(), body.begin(), body.end());
    return file;
}

ChunkContent& PackFile::chunk(const char (&type)[5], uint32_t subject) {
    for (ChunkContent& c : chunks)
        if (c.type == format::fourcc(type) && c.subject == subject) return c;
    ADD_FAILURE() << "no chunk " << type << " " << subject;
    return chunks.front();
}

}  // namespace dimmer::test
