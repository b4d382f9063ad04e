// What a scene of rays leaves as it was.
#include "test_scenes.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>
#include <trace/ray_scene.h>

#include <atomic>

namespace dimmer::cook::test {
namespace {

// It shows where this test has a process of its own, as ctest gives it: TBB must not have been asked for work before.
TEST(RayScene, LeavesDenormalNumbersToOthers) {
    Scene scene;
    addFloor(scene, 1, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    std::atomic<int> flushed = 0;
    tbb::parallel_for(0, 100'000, [&](int) {
        const volatile float denormal = 1e-40f;
        flushed += denormal * 1.0f == 0;
    });
    EXPECT_EQ(flushed, 0);
}

}  // namespace
}  // namespace dimmer::cook::test
