// Reads accessors. Nothing about them is trusted: counts, offsets and strides are checked against the bytes there are,
// in arithmetic that cannot overflow, before anything is allocated or read.
#pragma once

#include <scene/import_context.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace dimmer::cook {

enum class Attribute { Position, Normal, TexCoord };

// The elements of an accessor that a primitive's triangles use.
struct UsedVertices {
    static constexpr uint32_t unused = UINT32_MAX;

    std::span<const uint32_t> numbers;    // ascending or not; each once
    std::span<const uint32_t> number_of;  // per element: where it stands among `numbers`, or unused
};

// How many elements an attribute has. `accessor` must be in range. `owner` is whom messages name.
Expected<size_t> countElements(const ImportContext& context, int accessor, Attribute attribute,
                               const std::string& owner);

// An attribute's numbers, 3 (position, normal) or 2 (texture coordinates) per used element, normalised integers
// resolved and sparse elements applied; all finite. An accessor must have as many elements as number_of.
Expected<std::vector<float>> readAttribute(const ImportContext& context, int accessor, Attribute attribute,
                                           const UsedVertices& used, const std::string& owner);

// Vertex indices. The caller checks them against the number of vertices.
Expected<std::vector<uint32_t>> readIndices(const ImportContext& context, int accessor, const std::string& owner);

}  // namespace dimmer::cook
