// How fast followed light comes to its end.
#include <bake/convergence.h>
#include <bake/gathered_level.h>
#include <bake/test_scenes.h>

#include <cmath>
#include <complex>
#include <string>
#include <utility>
#include <vector>

namespace dimmer::cook::test {
namespace {

// T_n of Chebyshev.
std::complex<double> polynomial(uint32_t n, std::complex<double> z) {
    return std::cosh(static_cast<double>(n) * std::acosh(z));
}

// What is left of the error of x = 1 + eigenvalue * x after each round.
std::vector<std::complex<double>> errors(Acceleration acceleration, int channel, std::complex<double> eigenvalue,
                                         uint32_t rounds) {
    const std::complex<double> end = 1.0 / (1.0 - eigenvalue);
    std::complex<double> before = 0, x = 0;
    std::vector<std::complex<double>> left;
    for (uint32_t n = 0; n < rounds; ++n) {
        const auto weight = static_cast<double>(acceleration.nextWeight()[channel]);
        before = std::exchange(x, before + weight * (1.0 + eigenvalue * x - before));
        left.push_back((end - x) / end);
    }
    return left;
}

// It is T_n(eigenvalue / c) / T_n(1 / c), where c is how far the foci lie from 0: no other combination of n bounces
// leaves less over all eigenvalues from -c to c.
TEST(Acceleration, ErrorsAreChebyshevs) {
    const glm::vec3 albedo(0.3f, 0.7f, 0.95f);
    for (const uint32_t links : {4u, 64u, 1u << 20})
        for (int c = 0; c < 3; ++c) {
            const double rho = static_cast<double>(albedo[c]), foci = rho * std::sqrt(1 - 1.0 / links);
            for (const std::complex<double> share : {-1.0, -0.4, 0.0, 0.5, 0.9, 1.0, 1.04}) {
                const auto left = errors(Acceleration(albedo, links), c, share * rho, 12);
                for (uint32_t n = 1; n <= 12; ++n) {
                    const auto expected = polynomial(n, share * rho / foci) / polynomial(n, 1 / foci);
                    // Weights are floats, and errors of one round stay in the next ones.
                    EXPECT_LT(std::abs(left[n - 1] - expected), 1e-5) << rho << " " << share << " round " << n;
                }
            }
        }
}

// Nothing in the ellipse around real and complex eigenvalues is left more of than ratio() says, but for the factor of
// 2 by which T_n(z) differs from its larger part; and at its end on the real axis no less in the long run.
TEST(Acceleration, AsFewLinksNeedAndNoSlower) {
    for (const float albedo : {0.5f, 0.9f, 0.97f})
        for (const uint32_t links : {1u, 4u, 16u, 64u}) {
            const Acceleration acceleration(glm::vec3(albedo), links);
            const auto ratio = static_cast<double>(acceleration.ratio().x);
            EXPECT_LT(ratio, links == 1 ? albedo + 1e-6f : albedo);
            EXPECT_NEAR(acceleration.eigenvalueOf(ratio, 0), albedo, 1e-6);
            for (double angle = 0; angle < 2 * pi_d; angle += pi_d / 8) {
                const std::complex<double> eigenvalue(albedo * std::cos(angle),
                                                      albedo * std::sin(angle) / std::sqrt(links));
                const auto left = errors(acceleration, 0, eigenvalue, 24);
                for (uint32_t n = 1; n <= 24; ++n)
                    EXPECT_LE(std::abs(left[n - 1]), 2 * std::pow(ratio, n) + 1e-5) << albedo << " " << links;
            }
            if (ratio < 0.5) continue;  // floats show no more
            const auto left = errors(acceleration, 0, albedo, 24);
            EXPECT_NEAR(std::abs(left[23] / left[22]) / ratio, 1, 0.05) << albedo << " " << links;
        }
}

TEST(Acceleration, OfOneLinkIsPlain) {
    Acceleration acceleration(glm::vec3(0.2f, 0.9f, 0), 1);
    for (uint32_t n = 0; n < 9; ++n) EXPECT_EQ(acceleration.nextWeight(), glm::vec3(1));
    EXPECT_EQ(acceleration.ratio(), glm::vec3(0.2f, 0.9f, 0));
}

// Two walls of which each sees itself, the other and nothing through 3, 3 and 4 of ten rays: 0.3 times the sum of their
// albedos is left by a bounce. What lies behind doors does not count, though half of all links lead there.
TEST(LongRunAlbedo, OfTwoWallsThatSeeThemselvesAndEachOther) {
    Scene scene;
    Material red = lambert(1);
    red.base_color = {0.9f, 0.5f, 0};
    addQuad(scene, "a", {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, addMaterial(scene, lambert(0.4f)));
    addQuad(scene, "b", {0, 0, 1}, {2, 0, 0}, {0, 2, 0}, addMaterial(scene, red));
    const GatheredLevel level(scene);
    const BakedScene& b = level.b;
    std::vector<uint32_t> walls[2];
    for (uint32_t i = 0; i < b.texels.size(); ++i) walls[b.meshOf(i) == "b"].push_back(i);
    Links::Builder builder(b.texels.size());
    std::vector<Link> row;
    for (uint32_t i = 0; i < b.texels.size(); ++i) {
        row.clear();
        for (const auto& wall : walls)
            for (uint32_t ray = 0; ray < 3; ++ray) row.push_back({wall[hash(i, ray) % wall.size()], free_path});
        for (uint32_t ray = 0; ray < 6; ++ray) row.push_back({walls[1][hash(i, ray) % walls[1].size()], 1});
        builder.put(i, row);
    }
    const glm::vec3 albedo = longRunAlbedo(level.gatherer, builder.finish(), 10);
    // Each of 2,048 walks keeps more or less by half (standard deviation), so that a bounce's mean is off by 1.1 %, the
    // eight's by 0.4; blue, which either is left or not, by twice that.
    EXPECT_NEAR(albedo.x, 0.3 * (0.4 + 0.9), 0.012 * 0.39);
    EXPECT_NEAR(albedo.y, 0.3 * (0.4 + 0.5), 0.012 * 0.27);
    EXPECT_NEAR(albedo.z, 0.3 * 0.4, 0.024 * 0.12);
}

// Where one of a hundred rooms is nearly white, and light stays in it.
TEST(LongRunAlbedo, OfAWhiteRoomAmongDarkOnes) {
    Scene scene;
    const uint32_t dark = addMaterial(scene, lambert(0.6f)), white = addMaterial(scene, lambert(0.9f));
    for (uint32_t room = 0; room < 100; ++room)
        addQuad(scene, room == 42 ? "white" : "dark", {3.0f * room, 0, 0}, {2, 0, 0}, {0, 2, 0},
                room == 42 ? white : dark);
    const GatheredLevel level(scene, 2);
    const BakedScene& b = level.b;
    Links::Builder builder(b.texels.size());
    for (uint32_t i = 0; i < b.texels.size(); ++i) {
        std::vector<Link> itself = {{i, free_path}};
        builder.put(i, itself);
    }
    // After 24 bounces what is left of the dark rooms is 6e-5 of the white one's of each, which is 0.6 % of it for all.
    EXPECT_NEAR(longRunAlbedo(level.gatherer, builder.finish(), 1).y, 0.9, 0.01);
}

TEST(LongRunAlbedo, OfNothingIsNone) {
    Scene scene;
    addQuad(scene, "a", {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, addMaterial(scene, lambert(0.4f)));
    const GatheredLevel level(scene);
    const BakedScene& b = level.b;
    Links::Builder builder(b.texels.size());
    EXPECT_EQ(longRunAlbedo(level.gatherer, builder.finish(), 10), glm::vec3(0));
}

// Hollow spheres that see nothing of each other, each lit from its centre by a light set of its own.
struct Spheres {
    explicit Spheres(std::vector<glm::vec3> reflectances, const std::vector<float>& radii_m = {2, 1})
        : reflectance(std::move(reflectances)) {
        for (uint32_t n = 0; n < reflectance.size(); ++n) {
            Material material = lambert(1);
            material.base_color = reflectance[n];
            area_m2.push_back(addSphere(scene, radii_m[n], 32, 16, addMaterial(scene, material)));
            const float x = apart_m * static_cast<float>(n);
            for (glm::vec3& p : scene.meshes.back().positions_m) p.x += x;
            scene.light_sets.push_back({"set " + std::to_string(n), 1});
            addPointLight(scene, {x, 0, 0}, 1000, BakeMode::Indirect).light_set = n;
        }
    }
    // Of a sphere's set, in the mean over it, as shares of what arrives straight from the lamp.
    glm::dvec3 indirect(const BakedScene& b, uint32_t sphere) const {
        glm::dvec3 sum(0);
        double area = 0;
        for (size_t i = 0; i < b.texels.size(); ++i) {
            if (std::abs(b.place(i).x - apart_m * static_cast<float>(sphere)) > apart_m / 2) continue;
            sum += static_cast<double>(b.texels.area_m2[i]) * glm::dvec3(b.lux(i, groupOf(sphere)));
            area += static_cast<double>(b.texels.area_m2[i]);
        }
        return sum / area / (4 * pi_d * 1000 / area_m2[sphere]);
    }

    static constexpr float apart_m = 100;
    Scene scene;
    std::vector<glm::vec3> reflectance;
    std::vector<double> area_m2;
};
constexpr double rays_and_facets = 0.01;

// The method is paced by the larger room; of the smaller one's light the errors go through 0 on their way to and fro,
// and it must not be taken for finished there.
TEST(Convergence, GroupsEndWhenTheirOwnLightHasArrived) {
    constexpr float pairs[][2] = {{0.65f, 0.5f}, {0.65f, 0.3f}, {0.8f, 0.6f}, {0.95f, 0.92f}, {0.95f, 0.7f}};
    for (const auto& pair : pairs)
        for (const float tail : {0.01f, 0.002f}) {
            const Spheres spheres({glm::vec3(pair[0]), glm::vec3(pair[1])});
            BakedScene b(spheres.scene);
            b.bake({.series_rays = 128, .final_rays = 256, .tail_max = tail});
            EXPECT_TRUE(b.baked.warnings.empty()) << b.baked.warnings[0];
            for (uint32_t n = 0; n < 2; ++n) {
                const auto rho = static_cast<double>(pair[n]), expected = rho / (1 - rho);
                EXPECT_NEAR(spheres.indirect(b, n).y, expected, (tail + rays_and_facets) * expected)
                    << pair[0] << " " << pair[1] << " " << tail;
            }
        }
}

// What is left of light that a bounce leaves `eigenvalue` of when its group ends, at a pace for another albedo.
double leftAtTheEnd(double eigenvalue, float albedo, float tail_max) {
    Scene scene;
    addQuad(scene, "a", {0, 0, 0}, {20, 0, 0}, {0, 20, 0}, addMaterial(scene, lambert(0.4f)));
    const GatheredLevel level(scene);
    const BakedScene& b = level.b;
    Acceleration pace(glm::vec3(albedo), 128);
    Convergence convergence(level.gatherer.paths(), b.texels.area_m2, pace);
    const auto row = [](size_t i, double lux) {
        return TermLight(always_group, glm::vec3(static_cast<float>(lux)), Rounding(i, Rounding::Of::Bounced));
    };
    const double end = 1 / (1 - eigenvalue);
    double before = 0, x = 0;
    for (uint32_t round = 0; round < 200; ++round) {
        SparseLight::Builder light(b.texels.size());
        for (size_t i = 0; i < b.texels.size(); ++i) light.put(i, std::vector{row(i, x)});
        convergence.begin(light.finish());
        Sums all = convergence.none();
        Convergence::Part part(convergence, all);
        const double bounced = 1 + eigenvalue * x;
        for (size_t i = 0; i < b.texels.size(); ++i)
            part.addRow(i, std::vector<Convergence::Change>{
                               {always_group, row(i, x).value(), glm::vec3(static_cast<float>(bounced))}});
        part.closeBlock();
        convergence.end(all, std::vector<uint8_t>{1});
        before = std::exchange(x, before + static_cast<double>(pace.nextWeight().x) * (bounced - before));
        if (convergence.ends(always_group, tail_max)) return std::abs(end - x) / end;
    }
    return 1;
}

// A white room so small that the walks which look for the level's albedo do not find it, and rooms that an open door
// joins; and light that is gone sooner than the level's, whose error changes sign.
TEST(Convergence, LightIsFollowedToItsEndAtWhateverPace) {
    constexpr struct {
        float albedo;
        double eigenvalue;
    } cases[] = {{0.5f, 0.9},  {0.3f, 0.8},   {0.1f, 0.8},   {0.02f, 0.8}, {0, 0.5},    {0.75f, 0.9},
                 {0.8f, 0.9},  {0.65f, 0.5},  {0.65f, 0.2},  {0.65f, 0},   {0.9f, 0.6}, {0.9f, -0.5},
                 {0.95f, 0.9}, {0.06f, 0.06}, {0.03f, 0.03}, {0.98f, 0.98}};
    for (const auto& some : cases)
        for (const float tail : {0.02f, 0.01f, 0.002f})
            EXPECT_LE(leftAtTheEnd(some.eigenvalue, some.albedo, tail), static_cast<double>(tail))
                << some.albedo << " " << some.eigenvalue << " " << tail;
}

// Of texels that are large and a colour that is missing no number may come that is none.
TEST(Convergence, OfLargeTexelsWithoutRed) {
    const glm::vec3 rho(0, 0.5f, 0.8f);
    Spheres spheres({rho}, {40});
    BakedScene b(spheres.scene, 0.4f);
    b.bake({.series_rays = 128, .final_rays = 256});
    EXPECT_EQ(spheres.indirect(b, 0).x, 0);
    for (int c = 1; c < 3; ++c) {
        const auto r = static_cast<double>(rho[c]), expected = r / (1 - r);
        EXPECT_NEAR(spheres.indirect(b, 0)[c], expected, (rays_and_facets + 0.002) * expected) << r;
    }
}

// In a closed sphere of albedo 0.8 a bounce leaves 0.8, an accelerated one 0.8 / 1.6 in the long run: for a thousandth
// of the light some 10 rounds in place of 31. And a channel that walls all but swallow does not wait for ever for what
// its rounding leaves, nor do walls that are nearly white.
TEST(Convergence, TakesFewRounds) {
    const struct {
        glm::vec3 reflectance;
        float tail;
        uint32_t rounds;
    } cases[] = {{glm::vec3(0.8f), 0.001f, 14},
                 {{0.8f, 0.5f, 0.003f}, 0.001f, 14},
                 {glm::vec3(0.95f), 0.002f, 30},
                 {glm::vec3(0.98f), 0.01f, 63}};
    for (const auto& some : cases) {
        const Spheres spheres({some.reflectance});
        BakedScene b(spheres.scene);
        b.bake({.series_rays = 128, .final_rays = 256, .tail_max = some.tail});
        EXPECT_LE(b.baked.bounces, some.rounds);
        for (int c = 0; c < 3; ++c) {
            const auto rho = static_cast<double>(some.reflectance[c]), expected = rho / (1 - rho);
            EXPECT_NEAR(spheres.indirect(b, 0)[c], expected, rays_and_facets * expected) << rho;
        }
    }
}

// Someone who asks for two bounces and what a last look at them finds gets three, and not what more of them might come
// to; and hears of it.
TEST(Convergence, BouncesThatAreTooFewAreSoMany) {
    const Spheres spheres({glm::vec3(0.65f)});
    BakedScene b(spheres.scene);
    b.bake({.series_rays = 128, .final_rays = 256, .bounces_max = 2});
    constexpr double rho = 0.65, expected = rho + rho * rho + rho * rho * rho;
    EXPECT_NEAR(spheres.indirect(b, 0).y, expected, rays_and_facets * expected);
    EXPECT_EQ(b.baked.warnings.size(), 1u);
}

}  // namespace
}  // namespace dimmer::cook::test
