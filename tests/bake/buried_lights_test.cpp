// Lamps whose light something keeps in.
#include <bake/buried_lights.h>
#include <bake/test_scenes.h>
#include <gmock/gmock.h>
#include <trace/ray_scene.h>

namespace dimmer::cook::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> warningsIn(float half_m, const Material& casing, size_t faces = 6) {
    Scene scene;
    scene.file = "level.glb";
    addBox(scene, {4, 1.5f, 4}, addMaterial(scene, lambert(0.5f)));
    addPointLight(scene, {0, 0, 0}, 100, BakeMode::Indirect);
    const size_t first = scene.meshes.size();
    addSolid(scene, "casing", {0, 0, 0}, glm::vec3(half_m), addMaterial(scene, casing));
    scene.meshes.resize(first + faces);
    return warningsOfBuriedLights(RayScene(scene));
}

TEST(BuriedLights, ACasingThatLetsNothingOutIsTold) {
    Material both = lambert(0.5f), glass = both;
    both.double_sided = glass.double_sided = true;
    glass.alpha_mode = AlphaMode::Blend;
    glass.alpha = 0.2f;
    EXPECT_THAT(warningsIn(0.1f, both), ElementsAre(AllOf(HasSubstr("level.glb: node 'lamp'"), HasSubstr("'casing'"))));
    EXPECT_THAT(warningsIn(0.1f, glass), IsEmpty());
    EXPECT_THAT(warningsIn(0.1f, both, 5), IsEmpty()) << "open at one side";
    EXPECT_THAT(warningsIn(0.8f, both), IsEmpty()) << "a small room";
    EXPECT_THAT(warningsIn(0.1f, lambert(0.5f)), ElementsAre(HasSubstr("64 of 64 directions meet the back")));
}

}  // namespace
}  // namespace dimmer::cook::test
