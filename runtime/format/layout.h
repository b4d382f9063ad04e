// The byte layout of *.dimmer, shared by writer and reader. Little-endian. The format in prose: docs/format.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace dimmer::format {

inline constexpr std::array<char, 8> magic = {'D', 'I', 'M', 'M', 'E', 'R', '\r', '\n'};
inline constexpr uint32_t version = 9;
inline constexpr uint32_t endian_tag = 0x01020304;
inline constexpr uint64_t chunk_alignment_bytes = 64;

constexpr uint32_t fourcc(const char (&name)[5]) {
    return static_cast<uint32_t>(name[0]) | static_cast<uint32_t>(name[1]) << 8 | static_cast<uint32_t>(name[2]) << 16 |
           static_cast<uint32_t>(name[3]) << 24;
}

enum class ChunkType : uint32_t {
    Elements = fourcc("ELEM"),
    Contributions = fourcc("CONT"),
    BasePages = fourcc("BASE"),
    Clusters = fourcc("CLUS"),
    Terms = fourcc("TERM"),
    Batches = fourcc("BTCH"),
    Addresses = fourcc("ADDR"),
    Payload = fourcc("PAYL"),  // one per contribution; `subject` is its index
    // Light probes: all of these or none.
    ProbeBase = fourcc("PBAS"),
    ProbeClusters = fourcc("PCLU"),
    ProbeTerms = fourcc("PTRM"),
    ProbeBatches = fourcc("PBTC"),
    ProbeNumbers = fourcc("PNUM"),
    ProbeCounts = fourcc("PCNT"),
    ProbePayload = fourcc("PPAY"),
    GridPositions = fourcc("GPOS"),
    GridLevels = fourcc("GLEV"),
    GridTetrahedra = fourcc("GTET"),
    GridVisibility = fourcc("GVIS"),
    GridStarts = fourcc("GSTA"),
    GridBox = fourcc("GBOX"),
    LocalGrids = fourcc("LGRD"),
    Meshes = fourcc("MESH"),
    Viewpoints = fourcc("VIEW"),
    ModelMeshes = fourcc("MODM"),
    Models = fourcc("MODL"),
    Settings = fourcc("SETT"),
};

enum ChunkFlags : uint32_t {
    chunk_optional = 1,  // a reader that does not know the type skips it
    chunk_delta = 2,     // after the shuffle, what is stored of each byte is its difference from the one before it
};

struct Header {
    std::array<char, 8> magic;
    uint32_t version;
    uint32_t endian_tag;
    uint64_t file_bytes;
    uint64_t xxh64;  // of this header, with 0 here, and the chunk table that follows it
    float exposure;
    uint32_t page_width, page_height, page_count;
    uint32_t chunk_count;
    uint32_t color_format, direction_model;
    uint32_t reserved;
};
static_assert(sizeof(Header) == 64);

struct Chunk {
    uint32_t type;
    uint32_t flags;
    uint32_t subject;  // which contribution a payload belongs to, else 0
    uint32_t shuffle;  // bytes per record before the byte shuffle (byte i of all records together); 1: none
    uint64_t offset;   // from the start of the file, a multiple of 64
    uint64_t stored_bytes;
    uint64_t real_bytes;  // after decompression
    uint64_t xxh64;       // of the stored bytes
};
static_assert(sizeof(Chunk) == 48);

}  // namespace dimmer::format
