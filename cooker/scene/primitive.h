// One glTF primitive, decoded: node space, nothing transformed yet. Costs what its triangles use, however long the
// accessors are that it shares with others.
#pragma once

#include <scene/import_context.h>
#include <scene/material.h>

namespace dimmer::cook {

struct PrimitiveGeometry {
    std::vector<glm::vec3> positions;   // of vertices that triangles use, in their order
    std::vector<glm::vec3> normals;     // empty, or one per position
    std::vector<glm::vec2> uv0, uv1;    // empty, or one per position; uv0 is the base colour texture's, transformed
    std::vector<glm::uvec3> triangles;  // indices in range
    std::vector<std::string> warnings;  // of whoever has the primitive
};

// Triangles, strips and fans; other modes give a warning and no triangles. `owner` is whom errors name. `scratch`: of
// the last call, or empty.
Expected<PrimitiveGeometry> readPrimitive(const ImportContext& context, const tinygltf::Primitive& primitive,
                                          const TextureMapping& mapping, const std::string& owner,
                                          std::vector<uint32_t>& scratch);

}  // namespace dimmer::cook
