// glTF meshes to world-space triangles.
#pragma once

#include <scene/import_context.h>
#include <scene/material.h>
#include <scene/primitive.h>

#include <map>
#include <memory>

namespace dimmer::cook {

// Beyond this distance from the origin a float's step exceeds 6 cm, and areas may overflow.
inline constexpr double coordinate_max_m = 1e6;

// Turns some primitives of a mesh (indices into tinygltf::Mesh::primitives) into one SceneMesh with geometry and
// materials; everything else is left at its default. No triangles is not an error. Adds glTF's default material to the
// scene when a primitive has none, and warnings where something was mended or dropped.
class MeshImporter {
   public:
    MeshImporter(ImportContext& context, std::vector<TextureMapping> mappings);

    // `world_from_node` must not be singular.
    Expected<SceneMesh> import(int node, const std::vector<size_t>& primitives, const glm::dmat4& world_from_node);

    // The scene's material of a primitive.
    uint32_t materialOf(const tinygltf::Primitive& primitive);

   private:
    // Decoded once for all nodes that have the mesh.
    Expected<std::shared_ptr<const PrimitiveGeometry>> geometry(int mesh, size_t primitive,
                                                                const TextureMapping& mapping,
                                                                const std::string& owner);

    ImportContext& context_;
    std::vector<TextureMapping> mappings_;                                              // per material of the file
    std::vector<size_t> users_;                                                         // per mesh of the file: nodes
    std::map<std::pair<int, size_t>, std::shared_ptr<const PrimitiveGeometry>> known_;  // by mesh and primitive
    std::vector<uint32_t> scratch_;                                                     // readPrimitive's
    std::optional<uint32_t> default_material_;
    size_t triangles_total_ = 0;
};

}  // namespace dimmer::cook
