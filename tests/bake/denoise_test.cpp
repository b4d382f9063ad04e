// Which texels the filter averages.
#include <bake/baked_scene.h>
#include <bake/denoise.h>
#include <bake/test_scenes.h>
#include <pack/pack_data.h>

#include <cmath>
#include <map>
#include <random>
#include <utility>

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

// What is left of luxAt(receiver) where noise of the standard deviation `deviation`, in lux, is in each texel.
std::vector<float> denoised(const BakedScene& b, float deviation, auto&& luxAt) {
    const auto fill = [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) {
            ReceiverLight l;
            l.light.irradiance_lux = glm::vec3(luxAt(i));
            l.variance = deviation * deviation;
            emit(std::span<const ReceiverLight>(&l, 1));
        }
    };
    SilentProgress quiet;
    const auto light = denoise(*b.rays, b.charts, b.texels, Sparse<ReceiverLight>::build(b.texels.size(), fill), quiet);
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
        const auto luxAt = [&](size_t i) { return b.charts.faces[b.texels.face(i)].triangle < 2 ? 100.0f : 10.0f; };
        const std::vector<float> lux = denoised(b, 1000, luxAt);
        // Means of equal numbers: rounding alone.
        for (size_t i = 0; i < lux.size(); ++i) EXPECT_NEAR(lux[i], luxAt(i), 1e-3f) << i;
    }
}

// A checkerboard of 30 lux around 100. Where the kernel has all of its 5 taps in a row, it takes that away:
// 3/8 - 2/4 + 2/16 = 0. At an end 3 of them are left: (3/8 - 1/4 + 1/16) / (11/16) = 3/11 stays, and nowhere more.
// Further passes take means of what is left. The noise is so large that all texels count in full: 60 lux are 0.04
// deviations of a difference, weights 1 - 5e-4 at least, so that 60 * 5e-4 lux are left at most.
constexpr float checkers_lux = 30, stays_at_an_end = 3.0f / 11, deviation_lux = 1000, unequal_weights_lux = 0.03f;

void expectSmooth(const BakedScene& b, float off_max_lux) {
    const auto lux = denoised(b, deviation_lux, [&](size_t i) {
        const uint32_t at = b.texels.address[i];
        return 100 + checkers_lux * ((TexelAddress::x(at) + TexelAddress::y(at)) % 2 ? 1.0f : -1.0f);
    });
    for (size_t i = 0; i < lux.size(); ++i) EXPECT_NEAR(lux[i], 100, off_max_lux + unequal_weights_lux) << i;
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

// 8 x 8 m, 32 x 32 texels.
BakedScene floorScene() {
    Scene scene;
    addQuad(scene, "floor", {0, 0, 0}, {8, 0, 0}, {0, 0, -8}, addMaterial(scene, lambert(0.5f)));
    return BakedScene(scene);
}

// Under a lamp `height_m` above the floor's middle, E = peak (h^2 / (h^2 + r^2))^(3/2), with noise of known size. Half
// of the noise at least has to go, and what goes of the lamp's light must not come to more.
TEST(Denoise, NoiseGoesAndALampsLightStays) {
    const BakedScene b = floorScene();
    ASSERT_GE(b.texels.size(), 1024u);
    constexpr double peak_lux = 100, deviation = 4;
    for (const double height_m : {0.5, 1.0, 2.0}) {
        std::vector<double> truth;
        std::vector<float> noisy;
        std::mt19937 random(1);
        for (size_t i = 0; i < b.texels.size(); ++i) {
            truth.push_back(b.mean(i, [&](glm::dvec3 p) {
                const double r2 = (p.x - 4) * (p.x - 4) + (p.z + 4) * (p.z + 4);
                return peak_lux * std::pow(height_m * height_m / (height_m * height_m + r2), 1.5);
            }));
            double sum = 0;  // of 12 numbers of variance 1/12
            for (int k = 0; k < 12; ++k) sum += random() / 4294967296.0 - 0.5;
            noisy.push_back(static_cast<float>(truth[i] + deviation * sum));
        }
        const auto lux = denoised(b, deviation, [&](size_t i) { return noisy[i]; });
        double squares = 0;
        for (size_t i = 0; i < lux.size(); ++i) squares += (lux[i] - truth[i]) * (lux[i] - truth[i]);
        const double left = std::sqrt(squares / static_cast<double>(lux.size())) / deviation;
        EXPECT_LT(left, 0.5) << height_m;
    }
}

// A room with a lamp by the wall and a crate: with 128 rays a texel, as at draft, the filter has to bring light closer
// to what 32 times as many rays find. Noise of rays that are spread evenly is less than the spread of their rounds
// says, so a filter that trusts it flattens more light than noise.
TEST(Denoise, ABakeComesCloserToManyRays) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.6f));
    addBox(scene, {2.5f, 1.4f, 2.0f}, grey);
    addSolid(scene, "crate", {-1, -1, 0.5f}, {0.4f, 0.4f, 0.4f}, grey);
    addPointLight(scene, {1.9f, 0.8f, 0.3f}, 100, BakeMode::Indirect);
    BakedScene b(scene);
    const auto luxOf = [&](uint32_t rays, bool filtered) {
        b.bake({.series_rays = 32, .final_rays = rays, .denoise = filtered});
        std::vector<double> lux;
        for (size_t i = 0; i < b.texels.size(); ++i) lux.push_back(luminance(b.lux(i)));
        return lux;
    };
    const auto many = luxOf(4096, false), noisy = luxOf(128, false), filtered = luxOf(128, true);
    const auto off = [&](const std::vector<double>& lux) {
        double sum = 0;
        for (size_t i = 0; i < lux.size(); ++i) sum += std::abs(lux[i] - many[i]);
        return sum;
    };
    EXPECT_LT(off(filtered), 0.75 * off(noisy));
}

// 100 and 10 lux with an edge between, thirty deviations high: neither side takes anything of the other.
TEST(Denoise, AnEdgeThatIsNoNoiseStays) {
    const BakedScene b = floorScene();
    const auto luxAt = [&](size_t i) { return b.place(i).x < 3 ? 100.0f : 10.0f; };
    const auto lux = denoised(b, 3, luxAt);
    for (size_t i = 0; i < lux.size(); ++i) EXPECT_NEAR(lux[i], luxAt(i), 1e-3f) << i;
}

// A floor of 193,600 texels, of which filters replace the first 65,536 before they come to the next: over the line
// between them (9 m, 64 from the first cell of the order of space) texels become what they become in a floor of 6,400,
// where nothing is replaced before the end. So far from its edge that no filter comes to it.
TEST(Denoise, InPlaceWhatIsReadLateIsAsItWas) {
    const auto luxOf = [](const BakedScene& b, std::map<std::pair<int, int>, float>& by_place, float half_m) {
        const auto cell = [&](size_t i) {
            const glm::vec3 p = glm::floor(4.0f * b.place(i));
            return std::pair(static_cast<int>(p.x), static_cast<int>(p.z));
        };
        const auto lux = denoised(b, 10, [&](size_t i) {
            const auto [x, z] = cell(i);
            return 100 + 30 * unitFloat(hash(static_cast<uint32_t>(x + 1000), static_cast<uint32_t>(z + 1000)));
        });
        for (size_t i = 0; i < lux.size(); ++i) {
            const glm::vec3 off = glm::abs(b.place(i) - glm::vec3(9, 0, 9));
            if (std::max(off.x, off.z) < half_m && b.normal(i).y > 0) by_place[cell(i)] = lux[i];
        }
    };
    std::map<std::pair<int, int>, float> large, small;
    for (const bool whole : {true, false}) {
        Scene scene;
        const float half_m = whole ? 55 : 10;
        const glm::vec3 centre = whole ? glm::vec3(0) : glm::vec3(9, 0, 9);
        addQuad(scene, "floor", centre, {0, 0, half_m}, {half_m, 0, 0}, addMaterial(scene, lambert(0.5f)));
        const BakedScene b(scene, 4, 1);
        ASSERT_GE(b.texels.size(), whole ? 193'600u : 6'400u);
        luxOf(b, whole ? large : small, 5);
    }
    ASSERT_GE(small.size(), 1500u);
    EXPECT_EQ(large, small);
}

}  // namespace
}  // namespace dimmer::cook::test
