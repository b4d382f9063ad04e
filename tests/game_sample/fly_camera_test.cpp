#include <game_sample/fly_camera.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace dimmer::sample {
namespace {

constexpr float half_turn = std::numbers::pi_v<float>;

void expectNear(glm::vec3 a, glm::vec3 b) {
    EXPECT_LT(glm::length(a - b), 1e-5f) << a.x << " " << a.y << " " << a.z;
}

TEST(FlyCamera, WalksWhereItLooks) {
    const CameraPose from{{1, 2, 3}, {0, 0, -1}, 1};
    expectNear(fly(from, {.move = {0, 0, 1}}, 2).position_m, {1, 2, -2});  // 2.5 m/s
    expectNear(fly(from, {.move = {1, 0, 0}}, 2).position_m, {6, 2, 3});
    expectNear(fly(from, {.move = {0, -1, 0}, .faster = 2}, 1).position_m, {1, -3, 3});
    const CameraPose east{{0, 0, 0}, {1, 0, 0}, 1};
    expectNear(fly(east, {.move = {1, 0, 0}}, 1).position_m, {0, 0, 2.5f});
    EXPECT_EQ(fly(from, {}, 1).position_m, from.position_m);
}

TEST(FlyCamera, TwoKeysAreNoFasterThanOne) {
    const CameraPose to = fly({}, {.move = {1, 0, 1}}, 1);
    EXPECT_NEAR(glm::length(to.position_m), 2.5f, 1e-5f);
    EXPECT_NEAR(to.position_m.x, -to.position_m.z, 1e-5f);
}

TEST(FlyCamera, TurnsToTheRightAndUp) {
    expectNear(fly({}, {.turn_rad = {half_turn / 2, 0}}, 0).forward, {1, 0, 0});
    expectNear(fly({}, {.turn_rad = {0, half_turn / 4}}, 0).forward, {0, std::sqrt(0.5f), -std::sqrt(0.5f)});
    // Back where it began, the way it looked before.
    CameraPose pose{{0, 0, 0}, glm::normalize(glm::vec3(1, 0.5f, 2)), 1};
    const glm::vec3 before = pose.forward;
    for (int i = 0; i < 8; ++i) pose = fly(pose, {.turn_rad = {half_turn / 4, 0}}, 0);
    expectNear(pose.forward, before);
}

TEST(FlyCamera, NeverLooksQuiteStraightUpOrDown) {
    for (const glm::vec3 forward : {glm::vec3(0, -1, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, -1)})
        for (const float turn : {-10.0f, 0.0f, 10.0f}) {
            const CameraPose to = fly({{}, forward, 1}, {.move = {0, 0, 1}, .turn_rad = {0, turn}}, 1);
            EXPECT_NEAR(glm::length(to.forward), 1, 1e-5f);
            EXPECT_LT(std::abs(to.forward.y), 0.9999f);
            EXPECT_NEAR(glm::length(to.position_m), 2.5f, 1e-4f);
        }
}

}  // namespace
}  // namespace dimmer::sample
