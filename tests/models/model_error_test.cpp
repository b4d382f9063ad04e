// Models lit by their own grids, through the whole cook and the runtime, against the reference path tracer.
#include <models/model_scenes.h>
#include <pipeline/cooked_level.h>
#include <pipeline/verify_models.h>

namespace dimmer::cook::test {
namespace {

// One side of a box in cells of about `cell_m`: what a prop's own vertices know is known there.
void addSide(SceneMesh& mesh, glm::vec3 low, glm::vec3 high, int axis, bool positive, float cell_m) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto cells = [&](int a) { return std::max(1, static_cast<int>(std::ceil((high[a] - low[a]) / cell_m))); };
    const int nu = cells(u), nv = cells(v);
    const auto first = static_cast<uint32_t>(mesh.positions_m.size());
    for (int j = 0; j <= nv; ++j)
        for (int i = 0; i <= nu; ++i) {
            glm::vec3 p;
            p[axis] = positive ? high[axis] : low[axis];
            p[u] = glm::mix(low[u], high[u], static_cast<float>(i) / static_cast<float>(nu));
            p[v] = glm::mix(low[v], high[v], static_cast<float>(j) / static_cast<float>(nv));
            glm::vec3 normal(0);
            normal[axis] = positive ? 1.0f : -1.0f;
            mesh.positions_m.emplace_back(mesh.world_from_node * glm::dvec4(p, 1));
            mesh.normals.emplace_back(glm::dmat3(mesh.world_from_node) * glm::dvec3(normal));
        }
    for (int j = 0; j < nv; ++j)
        for (int i = 0; i < nu; ++i) {
            const uint32_t a = first + static_cast<uint32_t>(j * (nu + 1) + i), b = a + 1;
            const uint32_t c = a + static_cast<uint32_t>(nu) + 1, d = c + 1;
            for (const glm::uvec3 t : {glm::uvec3(a, b, d), glm::uvec3(a, d, c)}) {
                mesh.triangles.push_back(positive ? t : glm::uvec3(t.x, t.z, t.y));
                mesh.triangle_materials.push_back(mesh.triangle_materials.empty() ? 0 : mesh.triangle_materials[0]);
            }
        }
}

void addTable(Scene& scene, const glm::dmat4& at, uint32_t material) {
    SceneMesh mesh;
    mesh.node = "table";
    mesh.lighting = Lighting::LocalGrid;
    mesh.world_from_node = at;
    mesh.triangle_materials = {material};  // for addSide; taken off below
    const std::pair<glm::vec3, glm::vec3> boxes[] = {
        {{-0.6f, 0.7f, -0.35f}, {0.6f, 0.75f, 0.35f}}, {{-0.55f, 0.45f, -0.3f}, {0, 0.7f, 0.3f}},
        {{-0.58f, 0, -0.33f}, {-0.52f, 0.7f, -0.27f}}, {{0.52f, 0, -0.33f}, {0.58f, 0.7f, -0.27f}},
        {{-0.58f, 0, 0.27f}, {-0.52f, 0.7f, 0.33f}},   {{0.52f, 0, 0.27f}, {0.58f, 0.7f, 0.33f}},
        {{-0.1f, 0.75f, -0.1f}, {0.1f, 0.95f, 0.1f}}};
    for (const auto& [low, high] : boxes)
        for (int axis = 0; axis < 3; ++axis)
            for (const bool positive : {false, true}) addSide(mesh, low, high, axis, positive, 0.1f);
    mesh.triangle_materials.resize(mesh.triangles.size());
    scene.meshes.push_back(std::move(mesh));
}

// A room with a lamp that bounces, a bright panel and a table off the middle.
Scene tableRoom() {
    Scene scene;
    scene.file = "table_room";
    const uint32_t wood = addMaterial(scene, lambert(0.35f)), wall = addMaterial(scene, lambert(0.6f));
    const uint32_t panel = addMaterial(scene, emissive({400, 380, 350}, 0.2f));
    addBox(scene, {2.5f, 1.4f, 2}, wall);
    addQuad(scene, "window", {-2.49f, 0.3f, 0.4f}, {0, 0.5f, 0}, {0, 0, 0.6f}, panel);
    addTable(scene, placed({0.6, -1.4, -0.4}, 0.4), wood);
    scene.light_sets.push_back({"lamp", 1});
    addPointLight(scene, {1.2f, 0.9f, 1.2f}, 150, BakeMode::Indirect).light_set = 0;
    return scene;
}

class SlowModelError : public testing::Test {
   protected:
    static void SetUpTestSuite() {
        scene_ = std::make_unique<Scene>(tableRoom());
        pack_ = cooked(*scene_, "draft");
    }
    static void TearDownTestSuite() {
        scene_.reset();
        pack_.reset();
    }
    static ModelFigures figures(const std::string& state, glm::vec3 lamp) {
        const RayScene rays(*scene_);
        const ReferenceTracer tracer(rays, {.seed = 1, .set_weights = {lamp}});
        SilentProgress progress;
        // A floor of 1 % of some 100 lux in the room with all on.
        const auto figures =
            verifyModels(tracer, rays, *pack_, {.state = state, .points = 400, .paths_max = 4096}, 1, progress);
        if (!figures) {
            ADD_FAILURE() << figures.error().message;
            return {};
        }
        printf(
            "table, %s: mean %.2f %%, p95 %.2f %%, bias %+.2f %%; without self-visibility %.2f %%, %.2f %%, %+.2f %%\n",
            state.empty() ? "all on" : state.c_str(), 100 * figures->shadowed.mean, 100 * figures->shadowed.p95,
            100 * figures->shadowed.bias, 100 * figures->plain.mean, 100 * figures->plain.p95,
            100 * figures->plain.bias);
        return *figures;
    }
    static std::unique_ptr<Scene> scene_;
    static std::optional<Pack> pack_;
};
std::unique_ptr<Scene> SlowModelError::scene_;
std::optional<Pack> SlowModelError::pack_;

TEST_F(SlowModelError, MeanIsAtMostEightPerCentAndSelfVisibilityHalvesIt) {
    ASSERT_TRUE(pack_);
    const ModelFigures all_on = figures("", glm::vec3(1)), window = figures("lamp=0", glm::vec3(0));
    for (const ModelFigures* f : {&all_on, &window}) {
        EXPECT_LE(f->shadowed.mean, 0.08);  // the project's goal
        EXPECT_GT(f->shadowed.points, 300u);
        EXPECT_GT(f->plain.mean, 2 * f->shadowed.mean);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
