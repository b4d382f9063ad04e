#include <pipeline/model_meshes.h>

#include <models/scene_models.h>
#include <pack/mesh_codec.h>
#include <pipeline/level_meshes.h>
#include <probes/spherical_harmonics.h>
#include <scene/emission.h>

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace dimmer::cook {
namespace {

std::array<float, 3> toArray(glm::vec3 v) {
    return {v.x, v.y, v.z};
}

struct SurfacePoint {
    glm::vec3 position_m, normal;  // world space
    LightTransfer transfer;
};

// Triangles of one material, with vertices of the scene; both sides of what is double-sided.
struct MaterialPart {
    std::vector<SurfacePoint> points;
    std::vector<uint32_t> indices;
    std::map<std::tuple<uint32_t, uint32_t, bool>, uint32_t> index;  // of mesh, vertex, side

    void add(const SceneMesh& mesh, uint32_t mesh_index, const ModelTransfers& transfers, glm::uvec3 triangle,
             bool back) {
        for (int i = 0; i < 3; ++i) {
            const uint32_t vertex = triangle[back ? 2 - i : i];
            const auto [it, fresh] =
                index.try_emplace({mesh_index, vertex, back}, static_cast<uint32_t>(points.size()));
            if (fresh)
                points.push_back({mesh.positions_m[vertex], mesh.normals[vertex] * (back ? -1.0f : 1.0f),
                                  transfers[mesh_index][vertex][back]});
            indices.push_back(it->second);
        }
    }
};
using MaterialPartKey =
    std::pair<uint32_t, std::optional<uint32_t>>;  // material, and the light set that dims its emission

std::map<MaterialPartKey, MaterialPart> partsOf(const Scene& scene, const SceneModel& model) {
    const ModelTransfers& transfers = *model.transfers;
    std::map<MaterialPartKey, MaterialPart> parts;
    for (uint32_t m = 0; m < model.meshes.size(); ++m) {
        const SceneMesh& mesh = scene.meshes[model.meshes[m]];
        for (size_t t = 0; t < mesh.triangles.size(); ++t) {
            const uint32_t material = mesh.triangle_materials[t];
            MaterialPart& part = parts[{material, mesh.light_set}];
            part.add(mesh, m, transfers, mesh.triangles[t], false);
            if (scene.materials[material].double_sided) part.add(mesh, m, transfers, mesh.triangles[t], true);
        }
    }
    return parts;
}

class ModelMeshes {
   public:
    ModelMeshes(const Scene& scene, std::span<const glm::vec3> emission_cd_m2, PackData& pack)
        : scene_(scene), emission_cd_m2_(emission_cd_m2), pack_(pack), reflectances_(scene) {}

    // First mesh and their number.
    std::pair<uint32_t, uint32_t> of(const SceneModel& model) {
        const auto shape = shapeOf(scene_, model);
        if (!shape) return add(model);
        std::vector<std::optional<uint32_t>> light_sets;
        for (const uint32_t m : model.meshes) light_sets.push_back(scene_.meshes[m].light_set);
        const auto [it, fresh] = shared_.try_emplace({*shape, std::move(light_sets)});
        if (fresh) it->second = add(model);
        return it->second;
    }

   private:
    std::pair<uint32_t, uint32_t> add(const SceneModel& model) {
        const auto first = static_cast<uint32_t>(pack_.model_meshes.size());
        for (const auto& [key, part] : partsOf(scene_, model)) pack_.model_meshes.push_back(meshOf(model, key, part));
        return {first, static_cast<uint32_t>(pack_.model_meshes.size()) - first};
    }

    ModelMesh meshOf(const SceneModel& model, const MaterialPartKey& key, const MaterialPart& part) {
        const Material& material = scene_.materials[key.first];
        const glm::mat3 model_from_world = glm::transpose(model.world_from_model);
        std::vector<glm::vec3> positions;
        glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
        for (const SurfacePoint& p : part.points) {
            positions.push_back(model_from_world * (p.position_m - model.origin_m));
            low = glm::min(low, positions.back());
            high = glm::max(high, positions.back());
        }
        ModelMesh mesh;
        mesh.name = model.node;
        mesh.min_m = toArray(low);
        mesh.max_m = toArray(high);
        mesh.reflectance = toArray(reflectances_.of(key.first));
        const glm::vec3 emission = (emission_cd_m2_.empty() ? material.emission_cd_m2 : emission_cd_m2_[key.first]) *
                                   meanEmissionShare(scene_, model.meshes, key.first);
        mesh.emission_cd_m2 = toArray(emission);
        if (emission != glm::vec3(0)) mesh.emission_set = key.second;
        for (size_t i = 0; i < positions.size(); ++i)
            mesh.vertices.push_back(
                quantised(mesh, positions[i], model_from_world * part.points[i].normal, part.points[i].transfer));
        mesh.indices = part.indices;
        optimise(mesh);
        return mesh;
    }

    const Scene& scene_;
    std::span<const glm::vec3> emission_cd_m2_;
    PackData& pack_;
    MeanReflectances reflectances_;
    std::map<std::pair<ModelShape, std::vector<std::optional<uint32_t>>>, std::pair<uint32_t, uint32_t>> shared_;
};

// As modelNormal() unfolds it.
std::array<int16_t, 2> octahedral(glm::vec3 n) {
    n /= std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    glm::vec2 p(n.x, n.y);
    if (n.z < 0) p = {(1 - std::abs(n.y)) * std::copysign(1.0f, n.x), (1 - std::abs(n.x)) * std::copysign(1.0f, n.y)};
    return {static_cast<int16_t>(std::lround(p.x * 32767)), static_cast<int16_t>(std::lround(p.y * 32767))};
}

}  // namespace

ModelVertex quantised(const ModelMesh& box, glm::vec3 position_m, glm::vec3 normal, const LightTransfer& transfer) {
    ModelVertex vertex;
    for (size_t i = 0; i < 3; ++i) {
        const float side = box.max_m[i] - box.min_m[i];
        const float share = side > 0 ? (position_m[static_cast<int>(i)] - box.min_m[i]) / side : 0;
        vertex.position[i] = static_cast<uint16_t>(std::lround(std::clamp(share, 0.0f, 1.0f) * 65535));
    }
    vertex.normal = octahedral(normal);
    for (size_t i = 0; i < 9; ++i) {
        const float t = transfer.coefficients[i] / transfer_bounds[bandOf(i)];
        vertex.transfer[i] = static_cast<int8_t>(std::lround(127 * std::clamp(t, -1.0f, 1.0f)));
    }
    return vertex;
}

void optimise(ModelMesh& mesh) {
    std::vector<uint32_t>& indices = mesh.indices;
    std::vector<ModelVertex>& vertices = mesh.vertices;
    std::vector<uint32_t> remap(vertices.size());
    const size_t unique = meshopt_generateVertexRemap(remap.data(), indices.data(), indices.size(), vertices.data(),
                                                      vertices.size(), sizeof(ModelVertex));
    meshopt_remapIndexBuffer(indices.data(), indices.data(), indices.size(), remap.data());
    std::vector<ModelVertex> merged(unique);
    meshopt_remapVertexBuffer(merged.data(), vertices.data(), vertices.size(), sizeof(ModelVertex), remap.data());
    meshopt_optimizeVertexCache(indices.data(), indices.data(), indices.size(), unique);
    vertices.resize(unique);
    vertices.resize(meshopt_optimizeVertexFetch(vertices.data(), indices.data(), indices.size(), merged.data(), unique,
                                                sizeof(ModelVertex)));
    // The codec may begin a triangle at another corner: what is kept is what a reader will see.
    std::vector<std::byte> bytes(meshopt_encodeIndexBufferBound(indices.size(), vertices.size()));
    bytes.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), indices.data(),
                                           indices.size()));
    if (auto decoded = decodeIndices(static_cast<uint32_t>(indices.size()), bytes)) indices = std::move(*decoded);
}

void describeModels(const Scene& scene, std::span<const glm::vec3> emission_cd_m2, PackData& pack) {
    ModelMeshes meshes(scene, emission_cd_m2, pack);
    uint32_t local_grids = 0;
    for (const SceneModel& model : scene.models) {
        PlacedModel placed;
        placed.node = model.node;
        if (!model.meshes.empty()) std::tie(placed.first_mesh, placed.mesh_count) = meshes.of(model);
        if (!model.moves) placed.local_grid = local_grids++;
        for (int r = 0; r < 3; ++r) {
            auto& row = placed.world_from_model.rows[static_cast<size_t>(r)];
            row = {model.world_from_model[0][r], model.world_from_model[1][r], model.world_from_model[2][r],
                   model.origin_m[r]};
        }
        placed.min_m = toArray(model.min_m);
        placed.max_m = toArray(model.max_m);
        pack.models.push_back(std::move(placed));
    }
}

}  // namespace dimmer::cook
