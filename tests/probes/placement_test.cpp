// Where probes stand, of the places where they may.
#include <bake/test_scenes.h>
#include <gtest/gtest.h>
#include <probes/placement.h>
#include <probes/tetrahedra.h>

#include <algorithm>

#include <glm/gtc/matrix_transform.hpp>

namespace dimmer::cook::test {
namespace {

// 40 m x 6 m x 40 m, empty: whatever stands there sees all the rest.
Scene emptyHall() {
    Scene scene;
    addBox(scene, {20, 3, 20}, addMaterial(scene, lambert(0.5f)));
    return scene;
}

// The probes of a hall, lit as by three lamps, without the corners of its box.
std::vector<glm::vec3> probesOfHall(const Scene& scene, float min_spacing_m) {
    const RayScene rays(scene);
    const GridSettings settings{.probes_max = 200, .min_spacing_m = min_spacing_m, .sites = 8};
    const auto choice = chooseSites(rays, settings, nullptr);
    if (!choice) throw std::runtime_error(choice.error().message);
    std::vector<FitValue> states;
    for (const glm::vec3 p : choice->places()) {
        FitValue& light = states.emplace_back(FitValue{});
        for (const glm::vec3 lamp : {glm::vec3(-15, 2, -10), {3, 0, 4}, {12, 2, 15}})
            light[0] += 1 / (0.5f + glm::dot(p - lamp, p - lamp));
    }
    SilentProgress progress;
    const auto placement = placeProbes(rays, *choice, states, settings, progress);
    if (!placement) throw std::runtime_error(placement.error().message);
    std::vector<glm::vec3> probes;
    for (const ProbePosition& p : placement->grid.positions) probes.push_back(vec(p));
    probes.resize(probes.size() - 8);
    return probes;
}

float leastDistance(std::span<const glm::vec3> probes) {
    float least = far_away_m;
    for (size_t i = 0; i < probes.size(); ++i)
        for (size_t k = 0; k < i; ++k) least = std::min(least, glm::distance(probes[i], probes[k]));
    return least;
}

TEST(Placement, ProbesKeepTheDistanceThatIsAskedFor) {
    for (const float spacing_m : {2.0f, 6.0f, 11.0f}) {
        const auto probes = probesOfHall(emptyHall(), spacing_m);
        EXPECT_GE(leastDistance(probes), spacing_m);
        // Where none is within that distance one more may stand: discs of that radius cover the floor but for its edge.
        EXPECT_GT(static_cast<float>(probes.size()), 36 * 36 / (3.15f * spacing_m * spacing_m));
    }
}

TEST(Placement, OutsideOfPlayAreasTheyKeepTwiceThat) {
    Scene scene = emptyHall();
    // The half of the hall where x is below 0.
    const glm::mat4 box_from_centre = glm::scale(glm::mat4(1), 1.0f / glm::vec3(10, 3, 20));
    scene.play_areas.push_back({.box_from_world = glm::translate(box_from_centre, glm::vec3(10, 0, 0))});
    std::vector<glm::vec3> inside, outside;
    for (const glm::vec3 p : probesOfHall(scene, 3)) (p.x < 0 ? inside : outside).push_back(p);
    EXPECT_GT(inside.size(), outside.size());
    EXPECT_GT(outside.size(), 5u);
    EXPECT_GE(leastDistance(inside), 3);
    EXPECT_GE(leastDistance(outside), 6);
}

}  // namespace
}  // namespace dimmer::cook::test
