#include <models/self_visibility.h>

#include <bake/sampling.h>
#include <models/scene_models.h>
#include <probes/spherical_harmonics.h>
#include <trace/ray_scene.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

namespace dimmer::cook {
namespace {

// By the cosine; what is counted is how much of the lobe is hidden, so that what hides nothing has no noise.
constexpr uint32_t rays_per_point = 512;
constexpr int bounces = 2;
// Before the last round: its rays average over what these find, whose noise is then lost in theirs.
constexpr uint32_t rays_of_bounces = 64;
// Rays start this share of the model's size off the surface, and no less than a tenth of a millimetre.
constexpr float lift_share = 1e-3f, lift_min_m = 1e-4f;

// The model's meshes alone; rays do not see what moves.
Scene alone(const Scene& scene, const SceneModel& model) {
    Scene out;
    out.materials = scene.materials;
    out.textures = scene.textures;
    for (const uint32_t m : model.meshes) {
        out.meshes.push_back(scene.meshes[m]);
        out.meshes.back().lighting = Lighting::Lightmap;
    }
    return out;
}

class TransferTracer {
   public:
    TransferTracer(const Scene& scene, const SceneModel& model)
        : own_(alone(scene, model)),
          rays_(own_),
          model_from_world_(glm::transpose(model.world_from_model)),
          lift_m_(std::max(lift_min_m, lift_share * glm::length(model.max_m - model.min_m))) {
        for (uint32_t m = 0; m < own_.meshes.size(); ++m)
            for (uint32_t v = 0; v < own_.meshes[m].positions_m.size(); ++v) vertices_.emplace_back(m, v);
        for (const SceneMesh& mesh : own_.meshes)
            double_sided_.push_back(std::ranges::any_of(
                mesh.triangle_materials, [&](uint32_t material) { return own_.materials[material].double_sided; }));
        findIncident();
    }

    ModelTransfers run(Progress& progress) {
        for (const SceneMesh& mesh : own_.meshes) now_.emplace_back(mesh.positions_m.size());
        for (int bounce = 0; bounce <= bounces; ++bounce) {
            const uint32_t rays = bounce < bounces ? rays_of_bounces : rays_per_point;
            ModelTransfers next = now_;
            tbb::parallel_for(size_t{0}, vertices_.size(), [&](size_t i) {
                const auto [m, v] = vertices_[i];
                auto& sides = next[m][v];
                sides[0] = at(m, v, false, static_cast<uint32_t>(i), rays);
                sides[1] = double_sided_[m] ? at(m, v, true, static_cast<uint32_t>(i), rays) : sides[0];
                progress.advance(1);
            });
            now_ = std::move(next);
        }
        return std::move(now_);
    }

   private:
    // What the lobe sees of the model is replaced by what the model throws back. Rays start all over the triangles that
    // meet in the vertex, as often as they are drawn with the vertex's share (which has a density of 6 w (1 - w), that
    // of the middle one of three numbers): so the mean over the surface is right, and a corner that touches something
    // does not darken all around it (Kavan, Bargteil and Sloan 2011, Least Squares Vertex Baking, without the solve).
    LightTransfer at(uint32_t mesh, uint32_t vertex, bool back, uint32_t seed, uint32_t rays) const {
        const SceneMesh& m = own_.meshes[mesh];
        const auto& around = incident_[mesh][vertex];
        const glm::vec3 normal = m.normals[vertex] * (back ? -1.0f : 1.0f);
        glm::vec3 tangent, bitangent;
        orthonormalBasis(normal, tangent, bitangent);
        std::array<float, sh_count> change{};
        for (uint32_t i = 0; !around.empty() && i < rays; ++i) {
            const glm::vec3 d = cosineDirection(sequence2d(i, seed));
            const glm::vec3 direction = tangent * d.x + bitangent * d.y + normal * d.z;
            const Start start = startAt(around, m.positions_m[vertex], i, seed);
            const glm::vec3 up = start.normal * (back ? -1.0f : 1.0f);
            if (!(glm::dot(direction, up) > 0)) continue;  // a smooth normal's lobe dips below its triangles
            const auto hit = rays_.nearest(start.position_m + lift_m_ * up, direction, far_away_m, hash(seed, i));
            if (!hit) continue;
            const glm::vec3 inside = model_from_world_ * direction;
            const auto y = sphericalHarmonics({inside.x, inside.y, inside.z});
            const LightTransfer thrown = thrownBack(*hit);
            for (size_t k = 0; k < sh_count; ++k) change[k] += thrown.coefficients[k] - y[k];
        }
        const glm::vec3 n = model_from_world_ * normal;
        LightTransfer transfer = normalTransfer({n.x, n.y, n.z});
        for (size_t k = 0; k < sh_count; ++k) transfer.coefficients[k] += change[k] * pi / static_cast<float>(rays);
        return transfer;
    }

    struct Incident {
        glm::vec3 edge_a, edge_b, normal;  // from the vertex; unit
        float cumulative_m2;
    };
    struct Start {
        glm::vec3 position_m, normal;
    };
    static Start startAt(const std::vector<Incident>& around, glm::vec3 vertex_m, uint32_t i, uint32_t seed) {
        const auto number = [&](uint32_t k) { return unitFloat(hash(hash(seed, i), k)); };
        const float target = number(1) * around.back().cumulative_m2;
        auto t = std::ranges::upper_bound(around, target, {}, &Incident::cumulative_m2);
        if (t == around.end()) --t;
        const float a = number(2), b = number(3), c = number(4);
        const float own = std::max(std::min(a, b), std::min(std::max(a, b), c)), other = (1 - own) * number(5);
        return {vertex_m + other * t->edge_a + (1 - own - other) * t->edge_b, t->normal};
    }

    void findIncident() {
        for (const SceneMesh& mesh : own_.meshes) {
            auto& lists = incident_.emplace_back(mesh.positions_m.size());
            for (const glm::uvec3& t : mesh.triangles)
                for (int c = 0; c < 3; ++c) {
                    const glm::vec3 p = mesh.positions_m[t[c]];
                    const glm::vec3 a = mesh.positions_m[t[(c + 1) % 3]] - p, b = mesh.positions_m[t[(c + 2) % 3]] - p;
                    const glm::vec3 cross = glm::cross(a, b);
                    auto& list = lists[t[c]];
                    const float before = list.empty() ? 0 : list.back().cumulative_m2;
                    list.push_back({a, b, glm::normalize(cross), before + 0.5f * glm::length(cross)});
                }
        }
    }

    // Radiance that leaves the model there, per unit of radiance that arrives: rho / pi times the last round's
    // transfer. The backs of single-sided surfaces are black.
    LightTransfer thrownBack(const Hit& hit) const {
        const LevelTriangle& triangle = rays_.triangles()[hit.triangle];
        const Material& material = own_.materials[triangle.material];
        LightTransfer out;
        if (hit.back && !material.double_sided) return out;
        const glm::vec3 rho = material.reflectance(glm::vec3(rays_.surfaceColor(hit.triangle, hit.u, hit.v)));
        const float share = (rho.x + rho.y + rho.z) / (3 * pi);
        const glm::uvec3 corner = own_.meshes[triangle.mesh].triangles[triangle.triangle];
        const std::array weights{1 - hit.u - hit.v, hit.u, hit.v};
        for (size_t c = 0; c < 3; ++c) {
            const LightTransfer& t = now_[triangle.mesh][corner[static_cast<int>(c)]][hit.back];
            for (size_t k = 0; k < sh_count; ++k) out.coefficients[k] += share * weights[c] * t.coefficients[k];
        }
        return out;
    }

    Scene own_;
    RayScene rays_;
    glm::mat3 model_from_world_;
    float lift_m_;
    std::vector<bool> double_sided_;                            // by mesh: whether any of it is
    std::vector<std::pair<uint32_t, uint32_t>> vertices_;       // mesh, vertex
    std::vector<std::vector<std::vector<Incident>>> incident_;  // triangles, per mesh and vertex
    ModelTransfers now_;                                        // of the last round; black before the first
};

}  // namespace

ModelTransfers selfVisibility(const Scene& scene, const SceneModel& model, Progress& progress) {
    return TransferTracer(scene, model).run(progress);
}

void findTransfers(Scene& scene, Progress& progress) {
    std::vector<std::pair<SceneModel*, std::vector<SceneModel*>>> shapes;  // of each, its first model and the others
    std::map<ModelShape, size_t> known;
    uint64_t steps = 0;
    for (SceneModel& model : scene.models) {
        if (model.meshes.empty()) continue;
        const auto shape = shapeOf(scene, model);
        const auto [it, fresh] = shape ? known.try_emplace(*shape, shapes.size()) : std::pair(known.end(), true);
        if (!fresh) {
            shapes[it->second].second.push_back(&model);
            continue;
        }
        shapes.push_back({&model, {}});
        for (const uint32_t m : model.meshes) steps += scene.meshes[m].positions_m.size() * (bounces + 1);
    }
    if (shapes.empty()) return;
    progress.stage("models' own shadows", steps);
    for (auto& [first, others] : shapes) {
        first->transfers = std::make_shared<const ModelTransfers>(selfVisibility(scene, *first, progress));
        for (SceneModel* other : others) other->transfers = first->transfers;
    }
}

}  // namespace dimmer::cook
