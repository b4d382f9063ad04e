#include <models/scene_models.h>

#include <charts/planar.h>
#include <dimmer/models.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace dimmer::cook {
namespace {

// Fewer charts are few, and a mean of more than 0.2 m x 0.2 m is large: at the usual 4 texels per metre, what is
// smaller is one texel and a ring of padding eight times as large.
constexpr size_t few_charts = 32;
constexpr float small_chart_m2 = 0.04f;
// Probes of a grid stand 1.5 m apart at most: what is larger than a large thing, a ground or a vault, is no model.
constexpr float model_side_max_m = 4;
// What is in the same or in neighbouring cells is one thing.
constexpr float cell_m = 0.5f;
// No grid is thinner: probes on both sides of a sheet stand apart.
constexpr float thickness_min_m = 0.1f;
// Axes whose cosine is larger are sheared.
constexpr double shear_max = 1e-4;

bool fallsApart(const Scene& scene, const SceneMesh& mesh) {
    if (mesh.triangles.size() <= few_charts) return false;
    std::vector<PlanarFace> faces;
    float area_m2 = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        PlanarFace face{{}, {}, 4, 0};
        for (int i = 0; i < 3; ++i) face.corners_m[static_cast<size_t>(i)] = mesh.positions_m[mesh.triangles[t][i]];
        const glm::vec3 cross =
            glm::cross(face.corners_m[1] - face.corners_m[0], face.corners_m[2] - face.corners_m[0]);
        area_m2 += 0.5f * glm::length(cross);
        face.normal = glm::normalize(cross);
        if (scene.materials[mesh.triangle_materials[t]].emission_cd_m2 != glm::vec3(0)) return false;
        faces.push_back(face);
    }
    const size_t charts = planarCharts(faces, UINT16_MAX).size();
    return charts > few_charts && area_m2 < small_chart_m2 * static_cast<float>(charts);
}

bool isLarge(const SceneMesh& mesh) {
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const glm::vec3& p : mesh.positions_m) low = glm::min(low, p), high = glm::max(high, p);
    return glm::any(glm::greaterThan(high - low, glm::vec3(model_side_max_m)));
}

// Whether nothing of a mesh is more than a metre from the rest. Things that a tool has merged stand in different rooms,
// and one grid over them would carry the light of the one into the other.
bool hangsTogether(const SceneMesh& mesh) {
    using Cell = std::array<int, 3>;
    std::set<Cell> cells;
    for (const glm::uvec3& t : mesh.triangles) {
        const glm::vec3 a = mesh.positions_m[t.x], b = mesh.positions_m[t.y], c = mesh.positions_m[t.z];
        const glm::ivec3 low(glm::floor(glm::min(glm::min(a, b), c) / cell_m)),
            high(glm::floor(glm::max(glm::max(a, b), c) / cell_m));
        for (int x = low.x; x <= high.x; ++x)
            for (int y = low.y; y <= high.y; ++y)
                for (int z = low.z; z <= high.z; ++z) cells.insert({x, y, z});
    }
    std::vector<Cell> open = {*cells.begin()};
    cells.erase(cells.begin());
    while (!open.empty()) {
        const Cell at = open.back();
        open.pop_back();
        for (int neighbour = 0; neighbour < 27; ++neighbour) {
            const auto found =
                cells.find({at[0] + neighbour % 3 - 1, at[1] + neighbour / 3 % 3 - 1, at[2] + neighbour / 9 - 1});
            if (found == cells.end()) continue;
            open.push_back(*found);
            cells.erase(found);
        }
    }
    return cells.empty();
}

// How a node lies in the world, taken apart.
struct Frame {
    glm::mat3 world_from_model{1};
    glm::vec3 origin_m{0}, scale{1};
    bool rigid = false;
};

Frame frameOf(const glm::dmat4& world_from_node) {
    glm::dmat3 axes(world_from_node);
    glm::dvec3 scale;
    for (int i = 0; i < 3; ++i) {
        scale[i] = glm::length(axes[i]);
        axes[i] /= scale[i];
    }
    Frame frame{.origin_m = glm::vec3(glm::dvec3(world_from_node[3]))};
    for (int i = 0; i < 3; ++i)
        if (std::abs(glm::dot(axes[i], axes[(i + 1) % 3])) > shear_max) return frame;
    if (glm::determinant(axes) < 0) {
        axes[0] = -axes[0];
        scale.x = -scale.x;
    }
    frame.world_from_model = glm::mat3(axes);
    frame.scale = glm::vec3(scale);
    frame.rigid = true;
    return frame;
}

SceneModel modelAt(const std::string& node, const glm::dmat4& world_from_node) {
    const Frame frame = frameOf(world_from_node);
    SceneModel model;
    model.node = node;
    model.world_from_model = frame.world_from_model;
    model.origin_m = frame.origin_m;
    model.scale = frame.scale;
    model.is_instance_shape = frame.rigid;
    return model;
}

void fitBox(const Scene& scene, SceneModel& model) {
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const uint32_t m : model.meshes)
        for (const glm::vec3& p : scene.meshes[m].positions_m) {
            const glm::vec3 inside = glm::transpose(model.world_from_model) * (p - model.origin_m);
            low = glm::min(low, inside);
            high = glm::max(high, inside);
        }
    const glm::vec3 centre = 0.5f * (low + high), half = glm::max(0.5f * (high - low), 0.5f * thickness_min_m);
    model.min_m = centre - half;
    model.max_m = centre + half;
}

glm::uvec3 probesOf(const Scene& scene, const SceneModel& model, const ModelSettings& settings) {
    float spacing_m = settings.spacing_m;
    for (const uint32_t m : model.meshes)
        if (scene.meshes[m].grid_spacing_m) spacing_m = *scene.meshes[m].grid_spacing_m;
    const auto array = [](glm::vec3 v) { return std::array<float, 3>{v.x, v.y, v.z}; };
    const ModelGrid grid = modelGrid(array(model.min_m), array(model.max_m), spacing_m, settings.probes_max);
    return {grid.counts[0], grid.counts[1], grid.counts[2]};
}

glm::vec3 stepOf(const SceneModel& model, int axis) {
    const float length = model.max_m[axis] - model.min_m[axis];
    return model.world_from_model[axis] * (length / static_cast<float>(model.probes[axis] - 1));
}

}  // namespace

void chooseLighting(Scene& scene) {
    std::vector<SceneMesh*> by_grids;
    for (SceneMesh& mesh : scene.meshes) {
        if (mesh.lighting != Lighting::Automatic) continue;
        const bool grid = !mesh.door && !mesh.light_set && mesh.uv1.empty() && !isLarge(mesh) &&
                          fallsApart(scene, mesh) && hangsTogether(mesh);
        mesh.lighting = grid ? Lighting::LocalGrid : Lighting::Lightmap;
        if (grid) by_grids.push_back(&mesh);
    }
    // A room that is all curves is no model.
    if (std::ranges::none_of(scene.meshes, hasLightmap))
        for (SceneMesh* mesh : by_grids) mesh->lighting = Lighting::Lightmap;
}

void listModels(Scene& scene, const ModelSettings& settings) {
    scene.models.clear();
    std::map<int, uint32_t> of_node;
    for (uint32_t m = 0; m < scene.meshes.size(); ++m) {
        SceneMesh& mesh = scene.meshes[m];
        if (mesh.lighting != Lighting::LocalGrid && mesh.lighting != Lighting::Dynamic) continue;
        const auto next = static_cast<uint32_t>(scene.models.size());
        const uint32_t index = mesh.gltf_node < 0 ? next : of_node.try_emplace(mesh.gltf_node, next).first->second;
        if (index == next) {
            scene.models.push_back(modelAt(mesh.node, mesh.world_from_node));
            scene.models.back().moves = mesh.lighting == Lighting::Dynamic;
        }
        scene.models[index].meshes.push_back(m);
        mesh.model = index;
    }
    for (SceneModel& model : scene.models) {
        fitBox(scene, model);
        if (!model.moves) model.probes = probesOf(scene, model, settings);
    }
    for (const DynamicPlace& place : scene.dynamic_places) {
        scene.models.push_back(modelAt(place.node, place.world_from_node));
        scene.models.back().moves = true;
    }
}

namespace {

// Relative to itself: integer positions (KHR_mesh_quantization) have scales below 0.0001.
std::pair<int, long> roundedScale(float scale) {
    constexpr float tenth_of_a_permille = 1e4f;
    int exponent = 0;
    const long mantissa = std::lround(std::frexp(scale, &exponent) * tenth_of_a_permille);
    constexpr long one = 10000;
    if (std::abs(mantissa) == one) return {exponent + 1, mantissa / 2};
    return {exponent, mantissa};
}

}  // namespace

std::optional<ModelShape> shapeOf(const Scene& scene, const SceneModel& model) {
    if (model.meshes.empty() || !model.is_instance_shape) return {};
    ModelShape shape;
    shape.gltf_mesh = scene.meshes[model.meshes[0]].gltf_mesh;
    if (shape.gltf_mesh < 0) return {};
    for (int i = 0; i < 3; ++i) shape.scale[static_cast<size_t>(i)] = roundedScale(model.scale[i]);
    for (const uint32_t m : model.meshes) {
        shape.materials.push_back(scene.meshes[m].triangle_materials);
        shape.vertices.push_back(scene.meshes[m].positions_m.size());
    }
    return shape;
}

glm::vec3 probePosition(const SceneModel& model, uint32_t number) {
    const glm::uvec3 n = model.probes, at(number % n.x, number / n.x % n.y, number / n.x / n.y);
    return model.world(model.min_m) + stepOf(model, 0) * static_cast<float>(at.x) +
           stepOf(model, 1) * static_cast<float>(at.y) + stepOf(model, 2) * static_cast<float>(at.z);
}

std::vector<LocalGrid> localGrids(const Scene& scene, uint32_t first_probe) {
    std::vector<LocalGrid> grids;
    for (const SceneModel& model : scene.models) {
        if (model.moves) continue;
        const glm::vec3 origin = model.world(model.min_m);
        LocalGrid grid{model.node,
                       first_probe,
                       {model.probes.x, model.probes.y, model.probes.z},
                       {origin.x, origin.y, origin.z},
                       {}};
        for (int axis = 0; axis < 3; ++axis) {
            const glm::vec3 step = stepOf(model, axis);
            grid.step_m[static_cast<size_t>(axis)] = {step.x, step.y, step.z};
        }
        first_probe += static_cast<uint32_t>(grid.probeCount());
        grids.push_back(std::move(grid));
    }
    return grids;
}

}  // namespace dimmer::cook
