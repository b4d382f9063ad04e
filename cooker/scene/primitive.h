// One glTF primitive, decoded: node space, nothing transformed yet.
#pragma once

#include <scene/import_context.h>
#include <scene/material.h>

namespace dimmer::cook {

struct PrimitiveGeometry {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;     // empty, or one per position
    std::vector<glm::vec2> uv0, uv1;    // empty, or one per position; uv0 is the base colour texture's, transformed
    std::vector<glm::uvec3> triangles;  // indices in range
};

// Triangles, strips and fans; other modes give a warning and no triangles. `owner` is whom messages name.
Expected<PrimitiveGeometry> readPrimitive(ImportContext& context, const tinygltf::Primitive& primitive,
                                          const TextureMapping& mapping, const std::string& owner);

}  // namespace dimmer::cook
