// Reads accessors. Nothing about them is trusted: counts, offsets and strides are checked against the bytes there are,
// in arithmetic that cannot overflow, before anything is allocated or read.
#pragma once

#include <scene/import_context.h>

#include <cstdint>
#include <string>
#include <vector>

namespace dimmer::cook {

enum class Attribute { Position, Normal, TexCoord };

// An attribute's numbers, 3 (position, normal) or 2 (texture coordinates) per element, normalised integers resolved
// and sparse elements applied; all finite. `accessor` must be in range. `owner` is whom messages name.
Expected<std::vector<float>> readAttribute(const ImportContext& context, int accessor, Attribute attribute,
                                           const std::string& owner);

// Vertex indices. The caller checks them against the number of vertices.
Expected<std::vector<uint32_t>> readIndices(const ImportContext& context, int accessor, const std::string& owner);

}  // namespace dimmer::cook
