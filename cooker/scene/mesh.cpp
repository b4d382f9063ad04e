#include <fmt/format.h>
#include <scene/mesh.h>

#include <algorithm>
#include <limits>

namespace dimmer::cook {
namespace {

// Bounds what a small file that places one mesh very often can make us allocate (some 3 GB).
constexpr size_t triangles_max = size_t{1} << 25;

// Height over longest edge below which a triangle has no usable plane in floats.
constexpr double sliver_height = 1e-7;
// Smaller ones have areas and normals that floats round to nothing; no texel nor probe would tell them from a point.
constexpr double longest_edge_min_m = 1e-6;

// Appends primitives to one SceneMesh in world space, keeping only the vertices that triangles use.
class MeshBuilder {
   public:
    MeshBuilder(ImportContext& context, const glm::dmat4& world_from_node, const std::string& owner)
        : context_(context),
          world_from_node_(world_from_node),
          normal_from_node_(glm::transpose(glm::inverse(glm::dmat3(world_from_node)))),
          mirrored_(glm::determinant(glm::dmat3(world_from_node)) < 0),
          owner_(owner) {}

    Expected<void> append(const PrimitiveGeometry& primitive, uint32_t material) {
        std::vector<glm::vec3> positions;
        if (const auto ok = toWorld(primitive.positions, positions); !ok) return ok;
        const bool flat = primitive.normals.empty() && !primitive.triangles.empty();
        no_normals_ += flat;
        if (!primitive.triangles.empty()) {
            with_uv0_ += !primitive.uv0.empty();
            with_uv1_ += !primitive.uv1.empty();
            ++primitives_;
        }
        constexpr uint32_t unused = std::numeric_limits<uint32_t>::max();
        std::vector<uint32_t> copy_of(flat ? 0 : positions.size(), unused);
        for (glm::uvec3 triangle : primitive.triangles) {
            if (mirrored_) std::swap(triangle.y, triangle.z);
            const auto face_normal = faceNormal(positions, triangle);
            if (!face_normal) {
                ++degenerate_;
                continue;
            }
            for (int corner = 0; corner < 3; ++corner) {
                uint32_t& vertex = triangle[corner];
                const uint32_t source = vertex;
                if (flat || copy_of[source] == unused) {
                    const auto copy = static_cast<uint32_t>(mesh_.positions_m.size());
                    if (!flat) copy_of[source] = copy;
                    addVertex(primitive, positions, source, *face_normal);
                    vertex = copy;
                } else {
                    vertex = copy_of[source];
                }
            }
            mesh_.triangles.push_back(triangle);
            mesh_.triangle_materials.push_back(material);
        }
        return {};
    }

    SceneMesh finish() {
        if (degenerate_ > 0) context_.warn(owner_, fmt::format("{} triangles without area were dropped.", degenerate_));
        if (no_normals_ > 0) context_.warn(owner_, "has no normals; flat ones were made.");
        if (zero_normals_ > 0)
            context_.warn(owner_,
                          fmt::format("{} normals of length 0 were replaced by their triangles'.", zero_normals_));
        if (with_uv0_ == 0) mesh_.uv0.clear();
        if (with_uv1_ > 0 && with_uv1_ < primitives_)
            context_.warn(owner_, "only some of its primitives have TEXCOORD_1; charts are made instead.");
        if (with_uv1_ < primitives_) mesh_.uv1.clear();
        return std::move(mesh_);
    }

   private:
    Expected<void> toWorld(const std::vector<glm::vec3>& local, std::vector<glm::vec3>& world) const {
        world.reserve(local.size());
        for (const glm::vec3& position : local) {
            const glm::dvec3 placed = world_from_node_ * glm::dvec4(position, 1);
            if (!(glm::length(placed) <= coordinate_max_m))
                return context_.error(owner_,
                                      fmt::format("reaches more than {:.0f} km from the origin. Check its scale and "
                                                  "the unit (metres), or move the level.",
                                                  coordinate_max_m / 1000));
            world.emplace_back(placed);
        }
        return {};
    }

    static std::optional<glm::vec3> faceNormal(const std::vector<glm::vec3>& positions, glm::uvec3 t) {
        const glm::dvec3 a = positions[t.x], b = positions[t.y], c = positions[t.z];
        const glm::dvec3 cross = glm::cross(b - a, c - a);  // length: longest edge times height
        const double longest2 = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
        const double length = glm::length(cross);
        if (!(length > sliver_height * longest2) || longest2 < longest_edge_min_m * longest_edge_min_m)
            return std::nullopt;
        return glm::vec3(cross / length);
    }

    void addVertex(const PrimitiveGeometry& primitive, const std::vector<glm::vec3>& positions, uint32_t source,
                   glm::vec3 face_normal) {
        mesh_.positions_m.push_back(positions[source]);
        mesh_.normals.push_back(primitive.normals.empty() ? face_normal
                                                          : worldNormal(primitive.normals[source], face_normal));
        mesh_.uv0.push_back(primitive.uv0.empty() ? glm::vec2(0) : primitive.uv0[source]);
        mesh_.uv1.push_back(primitive.uv1.empty() ? glm::vec2(0) : primitive.uv1[source]);
    }

    glm::vec3 worldNormal(glm::vec3 normal, glm::vec3 face_normal) {
        const glm::dvec3 world = normal_from_node_ * glm::dvec3(normal);
        const double length = glm::length(world);
        if (length > 0 && std::isfinite(length) && glm::dot(normal, normal) > 0) return glm::vec3(world / length);
        ++zero_normals_;
        return face_normal;
    }

    ImportContext& context_;
    glm::dmat4 world_from_node_;
    glm::dmat3 normal_from_node_;
    bool mirrored_;
    const std::string& owner_;
    SceneMesh mesh_;
    size_t primitives_ = 0, with_uv0_ = 0, with_uv1_ = 0;
    size_t degenerate_ = 0, no_normals_ = 0, zero_normals_ = 0;
};

}  // namespace

MeshImporter::MeshImporter(ImportContext& context, std::vector<TextureMapping> mappings)
    : context_(context), mappings_(std::move(mappings)), users_(context.model.meshes.size()) {
    for (const tinygltf::Node& node : context.model.nodes)
        if (node.mesh >= 0) ++users_[static_cast<size_t>(node.mesh)];
}

Expected<std::shared_ptr<const PrimitiveGeometry>> MeshImporter::geometry(int mesh, size_t primitive,
                                                                          const TextureMapping& mapping,
                                                                          const std::string& owner) {
    const auto known = known_.find({mesh, primitive});
    if (known != known_.end()) return known->second;
    auto read = readPrimitive(context_, context_.model.meshes[static_cast<size_t>(mesh)].primitives[primitive], mapping,
                              owner, scratch_);
    if (!read) return std::unexpected(read.error());
    auto shared = std::make_shared<const PrimitiveGeometry>(std::move(*read));
    if (users_[static_cast<size_t>(mesh)] > 1) known_[{mesh, primitive}] = shared;
    return shared;
}

uint32_t MeshImporter::materialOf(const tinygltf::Primitive& primitive) {
    if (primitive.material >= 0) return static_cast<uint32_t>(primitive.material);
    if (!default_material_) {
        default_material_ = static_cast<uint32_t>(context_.scene.materials.size());
        context_.scene.materials.push_back(defaultMaterial());
    }
    return *default_material_;
}

Expected<SceneMesh> MeshImporter::import(int node, const std::vector<size_t>& primitives,
                                         const glm::dmat4& world_from_node) {
    const std::string owner = context_.nodeLabel(node);
    const int mesh_index = context_.model.nodes[static_cast<size_t>(node)].mesh;
    const tinygltf::Mesh& mesh = context_.model.meshes[static_cast<size_t>(mesh_index)];
    MeshBuilder builder(context_, world_from_node, owner);
    for (const size_t index : primitives) {
        const tinygltf::Primitive& primitive = mesh.primitives[index];
        const uint32_t material = materialOf(primitive);
        const TextureMapping mapping = primitive.material < 0 ? TextureMapping() : mappings_[material];
        const auto found = geometry(mesh_index, index, mapping, owner);
        if (!found) return std::unexpected(found.error());
        const PrimitiveGeometry& read = **found;
        for (const std::string& warning : read.warnings) context_.warn(owner, warning);
        triangles_total_ += read.triangles.size();
        if (triangles_total_ > triangles_max)
            return context_.error(
                owner, fmt::format("brings the level to more than {} triangles. Split the level.", triangles_max));
        if (primitive.material < 0)
            context_.warn(owner,
                          "has no material; glTF's default was used: white metal, reflectance 0.99. Give it one.");
        const Material& m = context_.scene.materials[material];
        if ((m.base_color_texture || m.emissive_texture) && read.uv0.empty() && !read.triangles.empty())
            context_.warn(owner,
                          fmt::format("has no TEXCOORD_{} for its material's texture; the texture's corner was used.",
                                      mapping.tex_coord));
        if (const auto ok = builder.append(read, material); !ok) return std::unexpected(ok.error());
    }
    return builder.finish();
}

}  // namespace dimmer::cook
