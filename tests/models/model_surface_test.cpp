// Places of models' surfaces, and the transfers that models of one shape share.
#include <models/model_scenes.h>
#include <models/model_surface.h>
#include <models/self_visibility.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

// A crate 1 m x 0.5 m x 2 m: sides of 2 m2, 1 m2 and 0.5 m2, twice each.
Scene crateIn(float room_half_m) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, glm::vec3(room_half_m), grey);
    addCrate(scene, "crate", placed({0.1, 0.2, 0}, 0.4), {0.5f, 0.25f, 1}, grey);
    listModels(scene, {});
    findTransfers(scene, no_progress);
    return scene;
}

glm::vec3 normalOf(const RayScene& rays, const ModelPlace& p) {
    const uint32_t side = p.point.face - triangle_faces;
    return rays.triangles()[side / 2].normal * (side % 2 ? -1.0f : 1.0f);
}

TEST(ModelPlaces, LieAllOverTheSurfaceByItsArea) {
    const Scene scene = crateIn(5);
    const RayScene rays(scene);
    const auto places = modelPlaces(rays, 0, 700);
    ASSERT_EQ(places.size(), 700u);
    size_t upwards = 0;
    for (const ModelPlace& p : places) {
        const glm::vec3 n = normalOf(rays, p);
        upwards += n.y > 0.9f;
        // A convex model hides nothing of itself: the transfer is that of its normal, turned as the model is.
        const LightTransfer whole = normalTransfer({n.x, n.y, n.z});
        for (size_t c = 0; c < 9; ++c) EXPECT_NEAR(p.transfer.coefficients[c], whole.coefficients[c], 1e-4f);
        float shares = 0;
        glm::vec3 between(0);
        for (size_t k = 0; k < 8; ++k) {
            shares += p.near.share[k];
            between += p.near.share[k] * probePosition(scene.models[0], p.near.number[k]);
        }
        EXPECT_NEAR(shares, 1, 1e-5f);
        // Linear between the probes is exact for positions; places are lifted by a millimetre.
        EXPECT_LT(glm::distance(between, p.point.position_m), 1.1e-3f);
    }
    // 2 m2 of 7 m2: 200 of 700, in a sequence that is more even than chance.
    EXPECT_NEAR(static_cast<double>(upwards), 200, 10);
}

TEST(ModelPlaces, NoneLieInOtherGeometry) {
    const Scene scene = crateIn(0.35f);  // walls that cut the crate: of its sides the lower one alone is in the room
    const RayScene rays(scene);
    const auto places = modelPlaces(rays, 0, 200);
    EXPECT_GT(places.size(), 20u);
    for (const ModelPlace& p : places)
        for (int axis = 0; axis < 3; ++axis) EXPECT_LT(std::abs(p.point.position_m[axis]), 0.35f);
}

// A leg that stands in a block of the same model: what of it lies inside of the block is seen by nobody.
TEST(ModelPlaces, NoneLieInsideOfTheModelItself) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {3, 3, 3}, grey);
    addCrate(scene, "post", placed({0, 0, 0}), {0.5f, 0.5f, 0.5f}, grey).gltf_node = 1;
    addCrate(scene, "post", placed({0, 0.5, 0}), {0.1f, 1, 0.1f}, grey).gltf_node = 1;
    listModels(scene, {});
    ASSERT_EQ(scene.models.size(), 1u);
    findTransfers(scene, no_progress);
    const RayScene rays(scene);
    const auto places = modelPlaces(rays, 0, 300);
    EXPECT_EQ(places.size(), 300u);
    for (const ModelPlace& p : places) {
        const glm::vec3 size = glm::abs(p.point.position_m);
        EXPECT_FALSE(size.x < 0.49f && size.y < 0.49f && size.z < 0.49f) << p.point.position_m.y;
    }
}

TEST(ModelPlaces, WhatIsDoubleSidedHasPlacesOnBothSides) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f)), cloth = addMaterial(scene, lambert(0.5f));
    scene.materials[cloth].double_sided = true;
    addBox(scene, {3, 3, 3}, grey);
    addQuad(scene, "curtain", {-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}, cloth).lighting = Lighting::LocalGrid;
    listModels(scene, {});
    findTransfers(scene, no_progress);
    const RayScene rays(scene);
    size_t front = 0;
    const auto places = modelPlaces(rays, 0, 400);
    for (const ModelPlace& p : places) {
        const glm::vec3 n = normalOf(rays, p);
        front += n.z > 0;
        EXPECT_GT(n.z * p.point.position_m.z, 0);  // lifted to its own side
        EXPECT_GT(n.z * p.transfer.coefficients[2], 0);
    }
    EXPECT_NEAR(static_cast<double>(front), 200, 10);
}

// Two nodes of two meshes each, one after another and between each other's, and a thing that moves: no ray meets it.
TEST(ForTriangles, AreThoseOfTheModelInTheOrderOfTheLevel) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {3, 3, 3}, grey);
    addCrate(scene, "a", placed({0, 0, 0}), {1, 1, 1}, grey).gltf_node = 1;
    addCrate(scene, "b", placed({0, 0, 0}), {1, 1, 1}, grey).gltf_node = 2;
    addCrate(scene, "c", placed({0, 0, 0}), {1, 1, 1}, grey, Lighting::Dynamic).gltf_node = 3;
    addCrate(scene, "a", placed({0, 0, 0}), {1, 1, 1}, grey).gltf_node = 1;
    addCrate(scene, "b", placed({0, 0, 0}), {1, 1, 1}, grey).gltf_node = 2;
    listModels(scene, {});
    ASSERT_EQ(scene.models.size(), 3u);
    const RayScene rays(scene);
    for (uint32_t model = 0; model < 3; ++model) {
        std::vector<uint32_t> expected, visited;
        for (uint32_t t = 0; t < rays.triangles().size(); ++t)
            if (scene.meshes[rays.triangles()[t].mesh].model == model) expected.push_back(t);
        EXPECT_EQ(expected.size(), scene.models[model].node == "c" ? 0u : 24u);
        forTriangles(rays, model, [&](uint32_t t, const LevelTriangle& triangle) {
            EXPECT_EQ(&triangle, &rays.triangles()[t]);
            visited.push_back(t);
        });
        EXPECT_EQ(visited, expected) << scene.models[model].node;
    }
}

TEST(FindTransfers, ModelsOfOneShapeShareTheirs) {
    Scene scene = crateInstances();
    // Which set dims it changes nothing of what it hides from itself: nor may it change which models share.
    scene.light_sets.push_back({"lamps", 1});
    scene.meshes[1].light_set = 0;
    listModels(scene, {});
    findTransfers(scene, no_progress);
    ASSERT_EQ(scene.models.size(), 3u);
    ASSERT_TRUE(scene.models[0].transfers);
    EXPECT_EQ(scene.models[0].transfers, scene.models[1].transfers);
    EXPECT_NE(scene.models[0].transfers, scene.models[2].transfers);
}

}  // namespace
}  // namespace dimmer::cook::test
