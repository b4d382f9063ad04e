// Which texels the filter averages.
#include <bake/baked_scene.h>
#include <bake/denoise.h>
#include <bake/test_scenes.h>
#include <pack/pack_data.h>

namespace dimmer::cook::test {
namespace {

// Adds the parallelogram centre +- u +- v to a mesh that brings an unwrap, as the rectangle from `low` to `high` of it.
void addPatch(SceneMesh& mesh, glm::vec3 centre, glm::vec3 u, glm::vec3 v, glm::vec2 low, glm::vec2 high) {
    const auto first = static_cast<uint32_t>(mesh.positions_m.size());
    for (const glm::vec2 side : {glm::vec2(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
        mesh.positions_m.push_back(centre + (2 * side.x - 1) * u + (2 * side.y - 1) * v);
        mesh.normals.push_back(glm::normalize(glm::cross(u, v)));
        mesh.uv1.push_back(glm::mix(low, high, side));
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
    mesh.triangle_materials.insert(mesh.triangle_materials.end(), 2, 0);
}

// A scene of one mesh; `add` fills it. Of 8 m2 on half of the unit square, so that 4 texels per metre are 16 x 8.
Scene unwrappedScene(auto&& add) {
    Scene scene;
    addMaterial(scene, lambert(0.5f));
    SceneMesh mesh;
    mesh.node = "mesh";
    mesh.lighting = Lighting::Lightmap;
    add(mesh);
    scene.meshes.push_back(std::move(mesh));
    return scene;
}

// What is left of luxAt(receiver) where each texel is off by `deviation_lux`.
std::vector<float> denoised(const BakedScene& b, float deviation_lux, auto&& luxAt) {
    const auto fill = [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) {
            ReceiverLight l;
            l.light.irradiance_lux = glm::vec3(luxAt(i));
            l.variance = deviation_lux * deviation_lux;
            emit(std::span<const ReceiverLight>(&l, 1));
        }
    };
    SilentProgress quiet;
    const auto light = denoise(b.charts, b.texels, Sparse<ReceiverLight>::build(b.texels.size(), fill), quiet);
    std::vector<float> lux;
    for (size_t i = 0; i < light.rows(); ++i) lux.push_back(light.row(i)[0].light.irradiance_lux.x);
    return lux;
}

// Two squares of 2 m, side by side on the page, whose noise would explain any difference: each keeps its own light.
TEST(Denoise, IslandsSideBySideOnAPageDoNotMix) {
    struct Other {
        const char* where;
        glm::vec3 centre, u, v;
    };
    const std::vector<Other> others = {{"ten metres off in the same plane", {11, 0, 0}, {1, 0, 0}, {0, 0, -1}},
                                       {"a step of one metre up", {1, 1, 0}, {1, 0, 0}, {0, 0, -1}},
                                       {"a wall on its edge", {0, 1, 0}, {0, 1, 0}, {0, 0, -1}},
                                       {"beside it, but turned on the page", {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}}};
    for (const Other& other : others) {
        SCOPED_TRACE(other.where);
        const BakedScene b(unwrappedScene([&](SceneMesh& mesh) {
            addPatch(mesh, {-1, 0, 0}, {1, 0, 0}, {0, 0, -1}, {0, 0}, {0.5f, 0.5f});
            addPatch(mesh, other.centre, other.u, other.v, {0.5f, 0}, {1, 0.5f});
        }));
        ASSERT_EQ(b.texels.size(), 128u);
        const auto luxAt = [&](size_t i) {
            return b.charts.faces[b.texels.sample(i, 0).face].triangle < 2 ? 100.0f : 10.0f;
        };
        const std::vector<float> lux = denoised(b, 1000, luxAt);
        // Means of equal numbers: rounding alone.
        for (size_t i = 0; i < lux.size(); ++i) EXPECT_NEAR(lux[i], luxAt(i), 1e-3f) << i;
    }
}

// A checkerboard of 30 lux around 100. Where the kernel has all of its 5 taps in a row, it takes that away:
// 3/8 - 2/4 + 2/16 = 0. At an end 3 of them are left: (3/8 - 1/4 + 1/16) / (11/16) = 3/11 stays, and nowhere more.
// Further passes take means of what is left.
constexpr float checkers_lux = 30, stays_at_an_end = 3.0f / 11;

void expectSmooth(const BakedScene& b, float off_max_lux) {
    const auto lux = denoised(b, checkers_lux, [&](size_t i) {
        const uint32_t at = b.texels.address[i];
        return 100 + checkers_lux * ((TexelAddress::x(at) + TexelAddress::y(at)) % 2 ? 1.0f : -1.0f);
    });
    for (size_t i = 0; i < lux.size(); ++i) EXPECT_NEAR(lux[i], 100, off_max_lux + 1e-3f) << i;
}

// However many triangles a wall of one island is cut into.
TEST(Denoise, AnIslandOfManyTrianglesIsSmoothed) {
    for (const int cuts : {1, 8}) {
        SCOPED_TRACE(cuts);
        const BakedScene b(unwrappedScene([&](SceneMesh& mesh) {
            const auto part = 1 / static_cast<float>(cuts);
            for (int i = 0; i < 2 * cuts; ++i)
                for (int k = 0; k < cuts; ++k) {
                    const glm::vec2 low = 0.5f * part * glm::vec2(i, k), middle_m = 4.0f * low + part;
                    addPatch(mesh, {middle_m, 0}, {part, 0, 0}, {0, part, 0}, low, low + 0.5f * part);
                }
        }));
        ASSERT_EQ(b.texels.size(), 128u);
        expectSmooth(b, checkers_lux * stays_at_an_end * stays_at_an_end);  // the most is left in the corners
    }
}

// Its texels are 12 times as long as wide: one row of 16.
TEST(Denoise, AThinStripIsSmoothed) {
    Scene scene;
    addQuad(scene, "strip", {0, 0, 0}, {2, 0, 0}, {0, 0.01f, 0}, addMaterial(scene, lambert(0.5f)));
    const BakedScene b(scene);
    ASSERT_EQ(b.texels.size(), 16u);
    expectSmooth(b, checkers_lux * stays_at_an_end);
}

}  // namespace
}  // namespace dimmer::cook::test
