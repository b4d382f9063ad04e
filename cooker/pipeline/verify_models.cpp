#include <pipeline/verify_models.h>

#include <bake/sampling.h>
#include <dimmer/cpu_runtime.h>
#include <dimmer/probe_grid.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr uint32_t tries_per_model_point = 20;
constexpr float covered_m = 0.01f, behind_m = 1e-3f;
constexpr int surfaces_max = 8;

glm::vec3 toVec(const std::array<float, 3>& a) {
    return {a[0], a[1], a[2]};
}

glm::vec3 turned(const Transform& t, glm::vec3 v) {
    const auto row = [&](size_t r) { return glm::vec3(t.rows[r][0], t.rows[r][1], t.rows[r][2]); };
    return {glm::dot(row(0), v), glm::dot(row(1), v), glm::dot(row(2), v)};
}

glm::vec3 placed(const Transform& t, glm::vec3 v) {
    return turned(t, v) + glm::vec3(t.rows[0][3], t.rows[1][3], t.rows[2][3]);
}

struct ModelTriangle {
    uint32_t model, mesh;
    std::array<uint32_t, 3> corner;
    double cumulative_m2;
};

std::vector<ModelTriangle> standingTriangles(const Pack& pack) {
    std::vector<ModelTriangle> out;
    double sum = 0;
    for (uint32_t m = 0; m < pack.models().size(); ++m) {
        const PlacedModel& model = pack.models()[m];
        for (uint32_t k = model.first_mesh; model.local_grid && k < model.first_mesh + model.mesh_count; ++k) {
            const ModelMesh& mesh = pack.modelMeshes()[k];
            for (size_t i = 0; i < mesh.indices.size(); i += 3) {
                const std::array corner{mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]};
                std::array<glm::vec3, 3> p;
                for (size_t c = 0; c < 3; ++c) p[c] = toVec(modelPosition(mesh, mesh.vertices[corner[c]]));
                sum += 0.5 * static_cast<double>(glm::length(glm::cross(p[1] - p[0], p[2] - p[0])));
                out.push_back({m, k, corner, sum});
            }
        }
    }
    return out;
}

// A place of a model as a fragment shader gets it.
struct ModelPoint {
    ModelSlot slot;
    glm::vec3 position_m{0}, normal{0};  // the triangle's own normal
    LightTransfer shadowed, plain;
};

ModelPoint modelPointOn(const Pack& pack, const ModelTriangle& t, glm::vec2 u) {
    const PlacedModel& model = pack.models()[t.model];
    const ModelMesh& mesh = pack.modelMeshes()[t.mesh];
    const glm::vec2 on = uniformOnTriangle(u);
    const std::array weights{1 - on.x - on.y, on.x, on.y};
    ModelPoint out;
    out.slot = pack.localGridSlot(*model.local_grid);
    std::array<glm::vec3, 3> p;
    glm::vec3 smooth(0);
    for (size_t c = 0; c < 3; ++c) {
        const ModelVertex& v = mesh.vertices[t.corner[c]];
        p[c] = placed(model.world_from_model, toVec(modelPosition(mesh, v)));
        out.position_m += weights[c] * p[c];
        smooth += weights[c] * turned(model.world_from_model, toVec(modelNormal(v)));
        const LightTransfer transfer = modelTransfer(v, model.world_from_model);
        for (size_t k = 0; k < 9; ++k) out.shadowed.coefficients[k] += weights[c] * transfer.coefficients[k];
    }
    out.normal = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
    smooth = glm::normalize(smooth);
    out.plain = normalTransfer({smooth.x, smooth.y, smooth.z});
    return out;
}

// What stands on the floor or leans on a wall has sides that nobody sees: something else lies on the place.
bool covered(const RayScene& rays, const std::string& node, const ModelPoint& p) {
    float from_m = -behind_m;
    for (int i = 0; i < surfaces_max; ++i) {
        const auto hit = rays.nearest(p.position_m + from_m * p.normal, p.normal, covered_m - from_m, 0);
        if (!hit) return false;
        if (rays.scene().meshes[rays.triangles()[hit->triangle].mesh].node != node) return true;
        from_m += hit->distance_m + 1e-5f;
    }
    return false;
}

std::vector<ModelPoint> chooseModelPoints(const Pack& pack, const RayScene& rays, uint32_t count, uint32_t seed) {
    std::vector<ModelPoint> points;
    const auto triangles = standingTriangles(pack);
    if (triangles.empty()) return points;
    for (uint32_t i = 0; points.size() < count && i < tries_per_model_point * count; ++i) {
        const glm::vec3 u = sequence3d(i, hash(seed, 0x30de1u));
        const double target = static_cast<double>(u.z) * triangles.back().cumulative_m2;
        auto t = std::ranges::upper_bound(triangles, target, {}, &ModelTriangle::cumulative_m2);
        if (t == triangles.end()) --t;
        const ModelPoint p = modelPointOn(pack, *t, {u.x, u.y});
        TangentFrame frame{{}, {}, p.normal};
        orthonormalBasis(p.normal, frame.tangent, frame.bitangent);
        if (!covered(rays, pack.models()[t->model].node, p) && !hidden(rays, p.position_m, frame, hash(seed, i)))
            points.push_back(p);
    }
    return points;
}

}  // namespace

Expected<ModelFigures> verifyModels(const ReferenceTracer& tracer, const RayScene& rays, const Pack& pack,
                                    const VerifyOptions& options, double floor_lux, Progress& progress) {
    const auto points = chooseModelPoints(pack, rays, options.points, options.seed);
    if (points.empty()) return ModelFigures{};
    CpuRuntime runtime(pack);
    if (auto ok = runtime.apply(options.state); !ok) return std::unexpected(ok.error());
    runtime.update();
    const GridSampler grid(pack, runtime.probes());
    std::vector<ReferencePoint> where;
    std::vector<double> shadowed, plain;
    const auto lux = [&](const ModelPoint& p, const LightTransfer& transfer) {
        const auto e = grid.sampleTransfer(p.slot, {p.position_m.x, p.position_m.y, p.position_m.z}, transfer);
        return static_cast<double>(luminance(toVec(e)));
    };
    for (const ModelPoint& p : points) {
        where.push_back({p.position_m, p.normal, p.normal});
        shadowed.push_back(lux(p, p.shadowed));
        plain.push_back(lux(p, p.plain));
    }
    const Measured m = measure(tracer, where, shadowed, floor_lux, options.paths_max, progress);
    ModelFigures figures;
    std::vector<LightPair> lit, lit_plain;
    for (size_t i = 0; i < points.size(); ++i) {
        if (!(m.pairs[i].value_lux > 0) && !(m.pairs[i].reference_lux > 0)) continue;
        lit.push_back(m.pairs[i]);
        figures.places.push_back({"models", where[i].position_m, where[i].normal, m.pairs[i]});
        lit_plain.push_back(m.pairs[i]);
        lit_plain.back().value_lux = plain[i];
    }
    figures.shadowed = lightError(lit, floor_lux);
    figures.plain = lightError(lit_plain, floor_lux);
    return figures;
}

}  // namespace dimmer::cook
