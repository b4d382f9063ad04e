#include <pack/mesh_codec.h>

#include <meshoptimizer.h>

namespace dimmer {
namespace {

// Blocks of up to 256 vertices cost at least 4 bytes for each of a vertex's bytes: 2 bits per 16 of them.
constexpr uint64_t vertex_expansion_max = 64, vertices_per_block = 256;

const unsigned char* raw(std::span<const std::byte> bytes) {
    return reinterpret_cast<const unsigned char*>(bytes.data());
}

}  // namespace

std::optional<std::vector<ModelVertex>> decodeVertices(uint32_t count, std::span<const std::byte> bytes) {
    const uint64_t most = bytes.size() * vertex_expansion_max / sizeof(ModelVertex) + vertices_per_block;
    if (count > most) return {};
    std::vector<ModelVertex> vertices(count);
    if (meshopt_decodeVertexBuffer(vertices.data(), count, sizeof(ModelVertex), raw(bytes), bytes.size()) != 0)
        return {};
    return vertices;
}

std::optional<std::vector<uint32_t>> decodeIndices(uint32_t count, std::span<const std::byte> bytes) {
    // A triangle costs a byte at least.
    if (count % 3 != 0 || count / 3 > bytes.size()) return {};
    std::vector<uint32_t> indices(count);
    if (meshopt_decodeIndexBuffer(indices.data(), count, sizeof(uint32_t), raw(bytes), bytes.size()) != 0) return {};
    return indices;
}

}  // namespace dimmer
