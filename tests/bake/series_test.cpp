// How long the light of a scene is followed.
#include <bake/baked_scene.h>
#include <bake/test_scenes.h>

namespace dimmer::cook::test {
namespace {

struct Ball {
    float reflectance, candela;
    double expectedLux(double area_m2) const {
        const double rho = static_cast<double>(reflectance);
        return 4 * pi_d * static_cast<double>(candela) / area_m2 * rho / (1 - rho);
    }
};

// Two hollow spheres that see nothing of each other, each lit from its centre: in one the light is soon gone, in the
// other it stays for long, at a hundredth of the brightness. Indirect = direct x rho / (1 - rho) in both.
TEST(Series, ADimWhiteRoomBesideABrightDarkOne) {
    Scene scene;
    const Ball balls[] = {{0.2f, 20000}, {0.9f, 50}};
    double area_m2 = 0;
    for (const Ball& ball : balls) {
        const auto number = static_cast<float>(&ball - balls);
        area_m2 = addSphere(scene, 2, 32, 16, addMaterial(scene, lambert(ball.reflectance)));
        SceneMesh& mesh = scene.meshes.back();
        for (glm::vec3& p : mesh.positions_m) p.x += 10 * number;
        addPointLight(scene, {10 * number, 0, 0}, ball.candela, BakeMode::Indirect);
    }
    BakedScene b(scene);
    b.bake({.series_rays = 128, .final_rays = 256, .tail_max = 0.01f});
    double sums[2] = {}, areas[2] = {};
    for (size_t i = 0; i < b.texels.size(); ++i) {
        const size_t ball = b.place(i).x > 5;
        const auto texel_m2 = static_cast<double>(b.texels.area_m2[i]);
        sums[ball] += texel_m2 * static_cast<double>(b.lux(i).y);
        areas[ball] += texel_m2;
    }
    for (size_t ball = 0; ball < 2; ++ball) {
        const double expected = balls[ball].expectedLux(area_m2);
        // 1 % that is still to come, and 1 % of rays and facets.
        EXPECT_NEAR(sums[ball] / areas[ball], expected, 0.02 * expected) << ball;
        printf("%g of %g lux\n", sums[ball] / areas[ball], expected);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
