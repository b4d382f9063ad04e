#include <pipeline/level_meshes.h>
#include <scene/emission.h>

#include <limits>
#include <map>
#include <tuple>

namespace dimmer::cook {
namespace {

std::array<float, 3> array(glm::vec3 v) {
    return {v.x, v.y, v.z};
}

class MeshBuilder {
   public:
    Mesh mesh;

    void add(const SceneMesh& from, uint32_t vertex, glm::vec2 uv, bool back) {
        const auto key = std::tuple(vertex, uv.x, uv.y, back);
        const auto [it, fresh] = index_.try_emplace(key, static_cast<uint32_t>(mesh.vertices.size()));
        if (fresh) {
            const glm::vec3 normal = back ? -from.normals[vertex] : from.normals[vertex];
            mesh.vertices.push_back({array(from.positions_m[vertex]), array(normal), {uv.x, uv.y}});
        }
        mesh.indices.push_back(it->second);
    }

   private:
    std::map<std::tuple<uint32_t, float, float, bool>, uint32_t> index_;
};

}  // namespace

glm::vec3 MeanReflectances::of(uint32_t material) {
    const auto [it, fresh] = known_.try_emplace(material);
    if (!fresh) return it->second;
    const Material& m = scene_.materials[material];
    glm::vec3 color = m.base_color;
    if (m.base_color_texture) color *= glm::vec3(scene_.textures[*m.base_color_texture]->mean());
    return it->second = m.reflectance(color);
}

std::vector<Mesh> levelMeshes(const RayScene& rays, const Unwrap& unwrap, std::span<const glm::vec3> emission_cd_m2) {
    const Scene& scene = rays.scene();
    const auto sets = static_cast<uint32_t>(scene.light_sets.size());
    const glm::vec2 page_size(unwrap.page_width, unwrap.page_height);
    std::map<std::tuple<uint32_t, uint32_t, uint32_t>, MeshBuilder> builders;  // scene mesh, material, page
    MeanReflectances reflectances(scene);
    for (uint32_t f = 0; f < unwrap.faces.size(); ++f) {
        const Face face = unwrap.faces[f];
        const LevelTriangle& t = rays.triangles()[face.triangle];
        const SceneMesh& from = scene.meshes[t.mesh];
        if (from.is_open_leaf) continue;  // the game moves the closed one
        const uint32_t page = unwrap.charts[unwrap.face_chart[f]].page;
        const auto [it, fresh] = builders.try_emplace({t.mesh, t.material, page});
        if (fresh) {
            const Material& material = scene.materials[t.material];
            Mesh& mesh = it->second.mesh;
            mesh.node = from.node;
            mesh.page = page;
            if (from.door) mesh.door = sets + *from.door;
            mesh.reflectance = array(reflectances.of(t.material));
            const glm::vec3 emission = (emission_cd_m2.empty() ? material.emission_cd_m2 : emission_cd_m2[t.material]) *
                                       meanEmissionShare(scene, {&t.mesh, 1}, t.material);
            mesh.emission_cd_m2 = array(emission);
            if (emission != glm::vec3(0)) mesh.emission_set = from.light_set;
        }
        for (int i = 0; i < 3; ++i) {
            const int c = face.back ? (3 - i) % 3 : i;  // seen from its own front
            it->second.add(from, from.triangles[t.triangle][c], unwrap.uv_texels[f][static_cast<size_t>(c)] / page_size,
                           face.back);
        }
    }
    std::vector<Mesh> meshes;
    for (auto& [key, builder] : builders) meshes.push_back(std::move(builder.mesh));
    return meshes;
}

std::string nodeThatDiffers(const Scene& scene, std::span<const Mesh> of_pack) {
    constexpr float same_m = 1e-3f;  // pieces of cut faces end within a rounding step
    struct Bounds {
        glm::vec3 min_m{std::numeric_limits<float>::max()}, max_m{std::numeric_limits<float>::lowest()};
        void add(glm::vec3 p) { min_m = glm::min(min_m, p), max_m = glm::max(max_m, p); }
    };
    std::map<std::string, Bounds> of_level, of_nodes;
    for (const SceneMesh& mesh : scene.meshes)
        for (const glm::uvec3& triangle : mesh.triangles)
            for (int i = 0; i < 3 && !mesh.is_open_leaf; ++i) of_level[mesh.node].add(mesh.positions_m[triangle[i]]);
    for (const Mesh& mesh : of_pack)
        for (const MeshVertex& v : mesh.vertices)
            of_nodes[mesh.node].add({v.position_m[0], v.position_m[1], v.position_m[2]});
    for (const auto& [node, box] : of_nodes) {
        const auto found = of_level.find(node);
        if (found == of_level.end()) return node;
        // Surfaces that are not lit are in no pack: its box may be smaller.
        const bool inside = glm::all(glm::greaterThanEqual(box.min_m, found->second.min_m - same_m)) &&
                            glm::all(glm::lessThanEqual(box.max_m, found->second.max_m + same_m));
        if (!inside) return node;
    }
    return {};
}

}  // namespace dimmer::cook
