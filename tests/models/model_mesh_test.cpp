// Meshes of models: what quantising and encoding costs, and what a model hides from itself.
#include <bake/sampling.h>
#include <dimmer/probe_grid.h>
#include <gtest/gtest.h>
#include <models/model_scenes.h>
#include <models/self_visibility.h>
#include <pack/sample_pack.h>
#include <pipeline/model_meshes.h>
#include <probes/spherical_harmonics.h>
#include <write/pack_writer.h>

#include <cstring>
#include <set>

namespace dimmer::cook::test {
namespace {

glm::vec3 vec(const std::array<float, 3>& a) {
    return {a[0], a[1], a[2]};
}

Transform transformOf(const glm::dmat4& m) {
    Transform t;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c)
            t.rows[static_cast<size_t>(r)][static_cast<size_t>(c)] = static_cast<float>(m[c][r]);
    return t;
}

// Integer positions have tiny scales, files in millimetres small ones: sizes that differ by a percent are two shapes,
// those that rounding parts are one, also across a power of two.
TEST(ModelShape, SizesAreToldApartAtAnyScale) {
    for (const double scale : {1.0, 1e-3, 1.22e-4, 1e-6, 512.0}) {
        Scene scene;
        const uint32_t grey = addMaterial(scene, lambert(0.5f));
        double x = 0;
        for (const double size : {1.0, 1.01, 1 - 1e-7, 1.2}) {
            x += 5;
            const glm::dmat4 at = glm::scale(placed({x, 0, 0}, x), glm::dvec3(scale * size));
            SceneMesh& mesh = addCrate(scene, "crate", at, glm::vec3(static_cast<float>(0.5 / scale)), grey);
            mesh.gltf_mesh = 7;
            mesh.gltf_node = static_cast<int>(scene.meshes.size());
        }
        listModels(scene, {});
        ASSERT_EQ(scene.models.size(), 4u);
        std::vector<ModelShape> shapes;
        for (const SceneModel& model : scene.models) {
            const auto shape = shapeOf(scene, model);
            ASSERT_TRUE(shape) << scale;
            shapes.push_back(*shape);
        }
        EXPECT_NE(shapes[0], shapes[1]) << scale;
        EXPECT_EQ(shapes[0], shapes[2]) << scale;
        EXPECT_NE(shapes[0], shapes[3]) << scale;
    }
}

TEST(ModelMesh, QuantisedVerticesAreAsExactAsStated) {
    ModelMesh box;
    box.min_m = {-1, 2, 0};
    box.max_m = {3, 2, 0.25f};  // flat along y
    for (uint32_t i = 0; i < 10000; ++i) {
        const glm::vec3 share = sequence3d(i, 1), side = vec(box.max_m) - vec(box.min_m);
        const glm::vec3 p = vec(box.min_m) + share * side, n = uniformSphereDirection(sequence2d(i, 2));
        const LightTransfer transfer = normalTransfer({n.x, n.y, n.z});
        const ModelVertex v = quantised(box, p, n, transfer);
        const glm::vec3 error = glm::abs(vec(modelPosition(box, v)) - p);
        // Half a step, and the rounding of floats near 3.
        for (int axis = 0; axis < 3; ++axis) ASSERT_LE(error[axis], 0.5f * side[axis] / 65535 + 5e-7f);
        // The chord of 0.004 degrees is 7.0e-5.
        ASSERT_LE(glm::distance(vec(modelNormal(v)), n), 7e-5f);
        const LightTransfer back = modelTransfer(v, Transform{});
        for (size_t k = 0; k < 9; ++k)
            ASSERT_NEAR(back.coefficients[k], transfer.coefficients[k],
                        0.5f / 127 * transfer_bounds[bandOf(k)] + 1e-6f);
    }
}

// The transfer of a turned model is that of its turned normals.
TEST(ModelMesh, TransferTurnsWithTheModel) {
    const ModelMesh box;
    for (uint32_t i = 0; i < 200; ++i) {
        const glm::vec3 n = uniformSphereDirection(sequence2d(i, 3)), axis = uniformSphereDirection(sequence2d(i, 4));
        const glm::dmat4 turned = glm::scale(placed({1, 2, 3}, 0.1 * i, axis), glm::dvec3(2));
        const glm::vec3 m = glm::normalize(glm::vec3(glm::dmat3(turned) * glm::dvec3(n)));
        const LightTransfer got =
            modelTransfer(quantised(box, {}, n, normalTransfer({n.x, n.y, n.z})), transformOf(turned));
        const LightTransfer wanted = normalTransfer({m.x, m.y, m.z});
        // Within a band a turn mixes errors of half a step without making their length larger.
        for (size_t k = 0; k < 9; ++k) {
            const size_t band = bandOf(k);
            const float half_step = 0.5f / 127 * transfer_bounds[band];
            EXPECT_NEAR(got.coefficients[k], wanted.coefficients[k],
                        half_step * std::sqrt(static_cast<float>(2 * band + 1)) + 1e-5f)
                << i << " " << k;
        }
    }
}

TEST(SelfVisibility, AConvexModelHidesNothing) {
    Scene scene;
    addCrate(scene, "crate", placed({3, 1, 2}, 0.4), {0.5f, 0.3f, 0.2f}, addMaterial(scene, lambert(0.5f)));
    listModels(scene, {});
    const auto transfers = selfVisibility(scene, scene.models[0], no_progress);
    const SceneMesh& mesh = scene.meshes[0];
    for (size_t i = 0; i < mesh.positions_m.size(); ++i) {
        const glm::vec3 n = glm::transpose(scene.models[0].world_from_model) * mesh.normals[i];
        const LightTransfer whole = normalTransfer({n.x, n.y, n.z});
        for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(transfers[0][i][0].coefficients[k], whole.coefficients[k], 1e-5f);
    }
}

// The share of an even light, 0 to 1, that a vertex gets: an even radiance of 1 has L_00 = 2 sqrt(pi), and gives pi.
double evenShare(const LightTransfer& t) {
    return static_cast<double>(t.coefficients[0]) * 2 * std::sqrt(std::numbers::pi) / std::numbers::pi;
}

// A tile with a lid 0.5 m above it that faces down.
Scene lidded(float rho) {
    Scene scene;
    const uint32_t material = addMaterial(scene, lambert(rho));
    SceneMesh& lid = addQuad(scene, "lid", {0, 0.5f, 0}, {1, 0, 0}, {0, 0, 1}, material);
    lid.lighting = Lighting::LocalGrid;
    lid.gltf_node = 1;
    SceneMesh& tile = addQuad(scene, "lid", {0, 0, 0}, {0, 0, 1e-3f}, {1e-3f, 0, 0}, material);
    tile.lighting = Lighting::LocalGrid;
    tile.gltf_node = 1;
    listModels(scene, {});
    return scene;
}

TEST(SelfVisibility, ALidHidesWhatItsFormFactorSays) {
    const Scene scene = lidded(0);
    const auto transfers = selfVisibility(scene, scene.models[0], no_progress);
    // Four corners of 1 m x 1 m at 0.5 m.
    const double seen = 1 - 4 * cornerFormFactor(1, 1, 0.5);
    // 512 rays of a low-discrepancy sequence: well within 1/22, the error of random ones.
    for (const auto& vertex : transfers[1]) EXPECT_NEAR(evenShare(vertex[0]), seen, 0.01);
}

// The lid's own light is the whole lobe's (the tile is a speck): it throws back rho of it.
TEST(SelfVisibility, ALidThrowsBackWhatItReflects) {
    const Scene scene = lidded(0.6f);
    const auto transfers = selfVisibility(scene, scene.models[0], no_progress);
    const double hidden = 4 * cornerFormFactor(1, 1, 0.5);
    for (const auto& vertex : transfers[1]) EXPECT_NEAR(evenShare(vertex[0]), 1 - hidden + 0.6 * hidden, 0.01);
}

TEST(ModelMesh, InstancesOfOneSizeShareTheirMesh) {
    Scene scene = crateInstances();
    addCrate(scene, "mover", placed({0, 0, 9}), {0.5f, 0.3f, 0.2f}, scene.meshes[0].triangle_materials[0],
             Lighting::Dynamic);
    scene.dynamic_places.push_back({"place", placed({1, 2, 3})});
    listModels(scene, {});
    PackData pack;
    findTransfers(scene, no_progress);
    describeModels(scene, {}, pack);
    ASSERT_EQ(pack.models.size(), 5u);
    EXPECT_EQ(pack.model_meshes.size(), 3u);
    EXPECT_EQ(pack.models[0].first_mesh, pack.models[1].first_mesh);
    EXPECT_NE(pack.models[0].first_mesh, pack.models[2].first_mesh);
    EXPECT_EQ(pack.models[1].local_grid, 1u);
    EXPECT_FALSE(pack.models[3].local_grid);
    EXPECT_EQ(pack.models[4].node, "place");
    EXPECT_EQ(pack.models[4].mesh_count, 0u);
    EXPECT_EQ(pack.models[4].world_from_model.rows[2][3], 3.0f);

    // The second's vertices are where the level has them: every corner of its crate, three times.
    const ModelMesh& mesh = pack.model_meshes[pack.models[1].first_mesh];
    EXPECT_EQ(mesh.vertices.size(), 24u);
    EXPECT_EQ(mesh.indices.size(), 36u);
    const auto& rows = pack.models[1].world_from_model.rows;
    for (const glm::vec3& wanted : scene.meshes[1].positions_m) {
        size_t found = 0;
        for (const ModelVertex& v : mesh.vertices) {
            const glm::vec3 p = vec(modelPosition(mesh, v));
            glm::vec3 world;
            for (int r = 0; r < 3; ++r) {
                const auto& row = rows[static_cast<size_t>(r)];
                world[r] = row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
            }
            found += glm::distance(world, wanted) < 3e-5f;  // steps of 1 m / 65535, and floats near 5
        }
        EXPECT_EQ(found, 3u);
    }
}

struct VertexLess {
    bool operator()(const ModelVertex& a, const ModelVertex& b) const { return std::memcmp(&a, &b, sizeof(a)) < 0; }
};
struct TriangleLess {
    bool operator()(const std::array<ModelVertex, 3>& a, const std::array<ModelVertex, 3>& b) const {
        return std::memcmp(a.data(), b.data(), sizeof(a)) < 0;
    }
};
using Triangles = std::multiset<std::array<ModelVertex, 3>, TriangleLess>;

// By their corners, beginning at the smallest and keeping the winding: what no reordering may change.
Triangles trianglesOf(const ModelMesh& mesh) {
    Triangles out;
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        std::array<ModelVertex, 3> t;
        for (size_t k = 0; k < 3; ++k) t[k] = mesh.vertices[mesh.indices[i + k]];
        std::rotate(t.begin(), std::min_element(t.begin(), t.end(), VertexLess()), t.end());
        out.insert(t);
    }
    return out;
}

TEST(ModelMesh, OptimisingAndEncodingKeepEveryTriangle) {
    ModelMesh mesh;
    dimmer::test::Random random(5);
    for (uint32_t i = 0; i < 600; ++i) {
        ModelVertex v;
        for (auto& p : v.position) p = static_cast<uint16_t>(random() % 40);  // some are alike
        mesh.vertices.push_back(v);
    }
    for (uint32_t i = 0; i < 1500; ++i) {
        std::array<uint32_t, 3> t;
        for (uint32_t& corner : t) corner = static_cast<uint32_t>(random() % 600);
        const auto& v = mesh.vertices;
        if (v[t[0]] == v[t[1]] || v[t[1]] == v[t[2]] || v[t[2]] == v[t[0]]) continue;
        mesh.indices.insert(mesh.indices.end(), t.begin(), t.end());
    }
    const auto before = trianglesOf(mesh);
    optimise(mesh);
    EXPECT_TRUE(before == trianglesOf(mesh));
    PackData data = dimmer::test::samplePack();
    data.model_meshes = {mesh};
    data.models = {};
    const auto pack = Pack::fromBytes(packBytes(data), "test");
    ASSERT_TRUE(pack) << pack.error().message;
    EXPECT_TRUE(pack->modelMeshes()[0].vertices == mesh.vertices);
    EXPECT_TRUE(before == trianglesOf(pack->modelMeshes()[0]));
}

}  // namespace
}  // namespace dimmer::cook::test
