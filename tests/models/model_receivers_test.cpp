// What the bounces know of models with light grids.
#include <gtest/gtest.h>
#include <models/model_receivers.h>
#include <models/model_scenes.h>

#include <memory>

namespace dimmer::cook::test {
namespace {

// A sheet of 2 m of which half is cut out, where its texture is white.
TEST(ModelReceivers, ReflectByWhatIsNotCutOut) {
    Texture texture{64, 1, TransferFunction::Linear, {}};
    for (int x = 0; x < 64; ++x)
        texture.texels.push_back(x < 32 ? glm::u8vec4(51, 51, 51, 255) : glm::u8vec4(255, 255, 255, 0));
    for (const AlphaMode mode : {AlphaMode::Mask, AlphaMode::Blend}) {
        Scene scene;
        scene.textures.push_back(std::make_shared<const Texture>(texture));
        addBox(scene, {3, 3, 3}, addMaterial(scene, lambert(0.5f)));
        Material leaves = lambert(1);
        leaves.alpha_mode = mode;
        leaves.double_sided = true;
        leaves.base_color_texture = 0;
        SceneMesh& sheet = addQuad(scene, "sheet", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, addMaterial(scene, leaves));
        sheet.lighting = Lighting::LocalGrid;
        sheet.uv0 = {{0.01f, 0}, {0.99f, 0}, {0.99f, 0}, {0.01f, 0}};  // within, so that the edges are not blurred
        listModels(scene, {});
        const RayScene rays(scene);
        const ModelReceivers receivers(rays);
        ASSERT_GT(receivers.size(), 0u);
        // A leaf of 0.2. Of 64 points some 32 are of the leaf, and a 64th of them, one or two, lie where filtering
        // mixes in white: at most 0.4 off. Holes and all, it were 0.6.
        for (size_t i = 0; i < receivers.size(); ++i) EXPECT_NEAR(receivers.reflectance(i).x, 0.2f, 2 * 0.4f / 32);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
