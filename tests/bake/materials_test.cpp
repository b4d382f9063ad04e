// What surfaces do to light on its way through the baker: cut out, let through, reflect on both sides or one, and by
// their texture.
#include <bake/baked_scene.h>
#include <bake/test_scenes.h>

namespace dimmer::cook::test {
namespace {

// The left half of one kind, the right half of another.
uint32_t addHalfImage(Scene& scene, glm::vec4 left, glm::vec4 right) {
    // Wide enough that filtering blurs a hundredth of it.
    Texture texture{64, 1, TransferFunction::Linear, {}};
    for (int x = 0; x < 64; ++x) texture.texels.emplace_back(glm::round(255.0f * (x < 32 ? left : right)));
    scene.textures.push_back(std::make_shared<const Texture>(std::move(texture)));
    return static_cast<uint32_t>(scene.textures.size() - 1);
}

void addUv(SceneMesh& quad) {
    quad.uv0 = {{0.001f, 0.5f}, {0.999f, 0.5f}, {0.999f, 0.5f}, {0.001f, 0.5f}};  // along the quad's u
}

double pointOverFloor(glm::dvec3 p, double candela, double height) {
    return candela * (height - p.y) / std::pow(p.x * p.x + p.z * p.z + (height - p.y) * (height - p.y), 1.5);
}

// A sheet half way to the lamp (facing down: under backs alone, the floor would count as buried), its -X half cut out:
// the floor's -X half is lit as if there were none, the rest is dark.
TEST(BakeMaterials, MaskCutsOut) {
    Scene scene;
    addFloor(scene, 2, addMaterial(scene, lambert(0)));
    Material sheet = lambert(0);
    sheet.alpha_mode = AlphaMode::Mask;
    sheet.base_color_texture = addHalfImage(scene, {1, 1, 1, 0.2f}, {1, 1, 1, 0.8f});
    addUv(addQuad(scene, "sheet", {0, 1, 0}, {3, 0, 0}, {0, 0, 3}, addMaterial(scene, sheet)));
    addPointLight(scene, {0, 2, 0}, 100, BakeMode::Full);
    BakedScene b(scene);
    b.bake({.final_rays = 32});
    int lit = 0, dark = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (b.meshOf(i) != "floor" || std::abs(b.place(i).x) < 0.5f) continue;  // the filtered edge
        if (b.place(i).x > 0) {
            ++dark;
            EXPECT_EQ(b.lux(i), glm::vec3(0));
        } else {
            ++lit;
            const double expected = b.mean(i, [](glm::dvec3 p) { return pointOverFloor(p, 100, 2); });
            EXPECT_NEAR(static_cast<double>(b.lux(i).y), expected, 1e-4 * expected);
        }
    }
    EXPECT_GT(lit, 50);
    EXPECT_GT(dark, 50);
}

// 1 - alpha of a lamp's light exactly, and of the sky's on average; two sheets multiply.
TEST(BakeMaterials, BlendLetsItsShareThrough) {
    Scene scene;
    addFloor(scene, 2, addMaterial(scene, lambert(0)));
    Material sheet = lambert(0);
    sheet.alpha_mode = AlphaMode::Blend;
    sheet.alpha = 0.4f;
    const uint32_t glass = addMaterial(scene, sheet);
    for (const float height : {1.0f, 1.5f})
        addQuad(scene, "sheet", {0, height, 0}, {500, 0, 0}, {0, 0, 500}, glass).lighting = Lighting::None;
    addPointLight(scene, {0, 2, 0}, 100, BakeMode::Full);
    BakedScene lamp(scene);
    lamp.bake({.final_rays = 32});
    for (size_t i = 0; i < lamp.texels.size(); ++i) {
        const double expected = 0.36 * lamp.mean(i, [](glm::dvec3 p) { return pointOverFloor(p, 100, 2); });
        EXPECT_NEAR(static_cast<double>(lamp.lux(i).y), expected, 1e-4 * expected);
    }
    scene.lights.clear();
    scene.sky_radiance_cd_m2 = glm::vec3(100);
    BakedScene sky(scene);
    sky.bake({.final_rays = 512});
    double mean = 0;
    for (size_t i = 0; i < sky.texels.size(); ++i) mean += static_cast<double>(sky.lux(i).y);
    mean /= static_cast<double>(sky.texels.size());
    // 256 texels x 512 rays that pass with 0.36: a standard error of 0.4 %. The rim of the sheets lets 1e-5 past.
    EXPECT_NEAR(mean, 0.36 * 100 * pi_d, 0.016 * 0.36 * 100 * pi_d);
}

// Light that a patch of the floor, [-half, half]^2, reflects up to a point of a ceiling: the integral over the floor of
// E rho / pi times the two cosines over the squared distance.
template <class Reflectance>
double fromFloor(glm::dvec3 point, double half, double candela, double lamp_m, double floor_m, Reflectance&& rho) {
    constexpr int n = 200;
    double sum = 0;
    const double side = 2 * half / n, h = point.y - floor_m;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double x = side * (i + 0.5) - half, z = side * (j + 0.5) - half;
            const double lit = candela * std::abs(lamp_m - floor_m) /
                               std::pow(x * x + z * z + (lamp_m - floor_m) * (lamp_m - floor_m), 1.5);
            const double d2 = (x - point.x) * (x - point.x) + (z - point.z) * (z - point.z) + h * h;
            sum += lit * rho(x, z) / pi_d * h * h / (d2 * d2) * side * side;
        }
    return sum;
}

// Mean light on the small black ceiling over the mean of what the integral says.
double ceilingRatio(const BakedScene& b, auto&& expected) {
    double found = 0, wanted = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (b.meshOf(i) != "ceiling") continue;
        found += static_cast<double>(b.lux(i).x);
        wanted += expected(glm::dvec3(b.place(i)));
    }
    EXPECT_GT(wanted, 0);
    return found / wanted;
}

Scene lampBetween(const Material& floor_material, bool floor_faces_up) {
    Scene scene;
    SceneMesh& floor = addFloor(scene, 3, addMaterial(scene, floor_material));
    if (!floor_faces_up)
        for (glm::uvec3& t : floor.triangles) std::swap(t.y, t.z);
    if (!floor_faces_up) floor.normals.assign(4, {0, -1, 0});
    addQuad(scene, "ceiling", {0, 3, 0}, {1, 0, 0}, {0, 0, 1}, addMaterial(scene, lambert(0)));
    addPointLight(scene, {0, 1.5f, 0}, 100, BakeMode::Indirect);
    return scene;
}

// 1.5 %: texels of 0.125 m at 1.5 m under a lamp stand for their sample points (0.5 %), 4096 rays at each of 256 texels
// are below 0.2 %, and the ceiling's points are one of four per texel.
constexpr double ceiling_tolerance = 0.015;
const BakeSettings many_rays{.series_rays = 64, .final_rays = 4096};

TEST(BakeMaterials, OneSideReflectsOrBoth) {
    const auto expected = [](glm::dvec3 p) { return fromFloor(p, 3, 100, 1.5, 0, [](double, double) { return 0.6; }); };
    BakedScene front(lampBetween(lambert(0.6f), true), 8);
    front.bake(many_rays);
    EXPECT_NEAR(ceilingRatio(front, expected), 1, ceiling_tolerance);
    BakedScene back(lampBetween(lambert(0.6f), false), 8);
    back.bake(many_rays);
    EXPECT_EQ(ceilingRatio(back, expected), 0);
    Material both = lambert(0.6f);
    both.double_sided = true;
    BakedScene double_sided(lampBetween(both, false), 8);
    double_sided.bake(many_rays);
    EXPECT_NEAR(ceilingRatio(double_sided, expected), 1, ceiling_tolerance);
}

TEST(BakeMaterials, TexturesReflectByTheirColour) {
    Material floor = lambert(1);
    Scene scene = lampBetween(floor, true);
    scene.materials[0].base_color = glm::vec3(1);
    scene.materials[0].base_color_texture = addHalfImage(scene, {0.8f, 0, 0, 1}, {0.2f, 0, 0, 1});
    // addFloor's u runs along +Z.
    addUv(scene.meshes[0]);
    BakedScene b(scene, 8);
    b.bake(many_rays);
    EXPECT_NEAR(ceilingRatio(b,
                             [](glm::dvec3 p) {
                                 return fromFloor(p, 3, 100, 1.5, 0,
                                                  [](double, double z) { return z < 0 ? 0.8 : 0.2; });
                             }),
                1, ceiling_tolerance);
    // And not its mean: the side over the bright half gets more.
    double bright = 0, dim = 0;
    for (size_t i = 0; i < b.texels.size(); ++i)
        if (b.meshOf(i) == "ceiling") (b.place(i).z < 0 ? bright : dim) += static_cast<double>(b.lux(i).x);
    EXPECT_GT(bright, 1.1 * dim);
    for (size_t i = 0; i < b.texels.size(); ++i) EXPECT_EQ(b.lux(i).y, 0);
}

// A wall stops what a decal on it lets through, however near the decal lies.
TEST(BakeMaterials, ADecalMakesNoHoleInItsWall) {
    for (const float gap_m : {0.0f, 5e-5f, 1e-3f}) {
        Scene scene;
        addFloor(scene, 2, addMaterial(scene, lambert(0.5f)));
        Material decal = lambert(0.5f);
        decal.alpha_mode = AlphaMode::Blend;
        decal.alpha = 0;
        addFloor(scene, 1, addMaterial(scene, decal), gap_m);
        const RayScene rays(scene);
        for (uint32_t seed = 0; seed < 64; ++seed) {
            const glm::vec3 from(0.9f - 0.025f * static_cast<float>(seed), 1, 0.3f);
            const auto hit = rays.nearest(from, {0, -1, 0}, 10, seed);
            ASSERT_TRUE(hit) << gap_m;
            EXPECT_LE(hit->distance_m, 1.0f + 1e-5f);
            EXPECT_EQ(rays.transmittance(from, {0, -1, 0}, 10), 0.0f);
        }
    }
}

// Floats tell steps of 0.24 mm apart there.
TEST(BakeMaterials, CutOutsFarAlongARayLetItPass) {
    Scene scene;
    Material net = lambert(0.5f);
    net.alpha_mode = AlphaMode::Blend;
    net.alpha = 0;
    addFloor(scene, 1, addMaterial(scene, net));
    const RayScene rays(scene);
    for (const float height_m : {1500.0f, 2500.0f, 100000.0f}) {
        EXPECT_FALSE(rays.nearest({0.1f, height_m, 0.2f}, {0, -1, 0}, 2 * height_m, 1)) << height_m;
        EXPECT_EQ(rays.transmittance({0.1f, height_m, 0.2f}, {0, -1, 0}, 2 * height_m), 1.0f) << height_m;
    }
}

// A model that is not there takes nothing along that touches it.
TEST(BakeMaterials, AnIgnoredModelLeavesItsFloor) {
    for (const float gap_m : {0.0f, 5e-5f, 1e-3f}) {
        Scene scene;
        const uint32_t grey = addMaterial(scene, lambert(0.5f));
        addFloor(scene, 2, grey);
        addSolid(scene, "crate", {0, 0.5f + gap_m, 0}, glm::vec3(0.5f), grey);
        for (SceneMesh& mesh : scene.meshes)
            if (mesh.node == "crate") mesh.model = 0;
        const RayScene rays(scene);
        for (int i = 0; i < 100; ++i) {
            const glm::vec3 from(0.4f - 0.008f * static_cast<float>(i), 0.5f, 0.1f);
            const auto hit = rays.nearest(from, {0, -1, 0}, 10, 1, Surfaces::All, 0);
            ASSERT_TRUE(hit) << gap_m;
            EXPECT_EQ(rays.triangles()[hit->triangle].mesh, 0u);
            EXPECT_EQ(rays.transmittance(from, {0, -1, 0}, 10, Surfaces::All, 0), 0.0f);
            EXPECT_EQ(rays.transmittance(from, {0, 1, 0}, 10, Surfaces::All, 0), 1.0f);
        }
    }
}

// As the comment on transparent_layers_max has it: a ray that passes 64 layers is stopped, not under the open sky.
TEST(BakeMaterials, ARayDoesNotPassAnyNumberOfLayers) {
    Scene scene;
    Material leaf = lambert(0.5f);
    leaf.alpha_mode = AlphaMode::Blend;
    leaf.alpha = 0;
    const uint32_t material = addMaterial(scene, leaf);
    for (int i = 0; i < 70; ++i) addFloor(scene, 1, material, 0.1f * static_cast<float>(i));
    const RayScene rays(scene);
    EXPECT_TRUE(rays.nearest({0.3f, 8, 0.2f}, {0, -1, 0}, 100, 1));
    EXPECT_EQ(rays.transmittance({0.3f, 8, 0.2f}, {0, -1, 0}, 100), 0.0f);
    EXPECT_FALSE(rays.nearest({0.3f, 2.05f, 0.2f}, {0, -1, 0}, 100, 1));  // 21 layers
    EXPECT_EQ(rays.transmittance({0.3f, 2.05f, 0.2f}, {0, -1, 0}, 100), 1.0f);
}

// A lamp of which alpha leaves a quarter shines a quarter, found by area or by hit.
TEST(BakeMaterials, AnEmittersHolesDoNotShine) {
    const auto fluxOf = [](float alpha) {
        Scene scene;
        addFloor(scene, 2, addMaterial(scene, lambert(0)));
        Material panel = emissive(glm::vec3(40));
        panel.alpha_mode = AlphaMode::Blend;
        panel.alpha = alpha;
        addQuad(scene, "panel", {0, 1, 0}, {0.5f, 0, 0}, {0, 0, 0.5f}, addMaterial(scene, panel)).lighting =
            Lighting::None;
        BakedScene b(scene);
        b.bake({.final_rays = 256});
        double sum = 0;
        for (size_t i = 0; i < b.texels.size(); ++i) sum += static_cast<double>(b.lux(i).y);
        return sum;
    };
    // 256 texels x 256 rays and 64 samples of the panel: a standard error below 1 %.
    EXPECT_NEAR(fluxOf(0.25f) / fluxOf(1), 0.25, 0.01);
}

// The edge of a shadow that is stored lies where it is, from however far the lamp shines.
TEST(BakeMaterials, AFarLampsShadowHasItsEdge) {
    const glm::dvec3 lamp(1.75, 15, 0.2);  // the edge is at x = -0.125, amid texels
    Scene scene;
    addFloor(scene, 2, addMaterial(scene, lambert(0)));
    // Over all with x > 0, one metre up; it faces down.
    addQuad(scene, "sheet", {4, 1, 0}, {4, 0, 0}, {0, 0, 8}, addMaterial(scene, lambert(0))).lighting = Lighting::None;
    addPointLight(scene, glm::vec3(lamp), 1000, BakeMode::Full);
    BakedScene b(scene);
    b.bake({.final_rays = 32});
    int edge = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        const auto litAt = [&](glm::dvec3 p) {
            const glm::dvec3 way = lamp - p;
            const bool shadowed = p.x + way.x / way.y > 0;
            return shadowed ? 0 : 1000 * way.y / std::pow(glm::dot(way, way), 1.5);
        };
        const double expected = b.mean(i, litAt);
        EXPECT_NEAR(static_cast<double>(b.lux(i).y), expected, 1e-3 * expected) << i;
        edge += expected > 0.5 && expected < 4;  // between dark and 1000 / 15^2
    }
    EXPECT_GT(edge, 10);
}

}  // namespace
}  // namespace dimmer::cook::test
