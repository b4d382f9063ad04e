// Meshes that are named as what nobody sees.
#include <scene/expectations.h>

namespace dimmer::cook::test {
namespace {

LevelFile levelWith(std::initializer_list<const char*> names, const json& extras = json::object()) {
    LevelFile level = LevelFile::withFloor();
    const int square = level.addSquareMesh(0);
    for (const char* name : names) level.addNode({{"name", name}, {"mesh", square}, {"extras", extras}});
    return level;
}

size_t warningsOf(const LevelFile& level) {
    const auto scene = level.import();
    return scene ? scene->warnings.size() : 99;
}

TEST(Leftovers, CollisionShapesAreToldOnceWithTheirNumber) {
    const auto scene = levelWith({"UCX_shelf_01", "ubx_box", "wall-colonly"}).import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->warnings.size(), 1u);
    expectWarning(*scene, {"node 'UCX_shelf_01' (and 2 more like it)", "collision shape", "dimmer_lighting"});
}

TEST(Leftovers, CoarserDetailsAreToldWhereTheFinestIsThereToo) {
    for (const auto& [finest, coarser] : {std::pair{"shelf_LOD0", "shelf_LOD1"}, {"shelf", "Shelf_lod3"}}) {
        const auto scene = levelWith({coarser, finest}).import();
        ASSERT_IMPORTED(scene);
        ASSERT_EQ(scene->warnings.size(), 1u);
        expectWarning(*scene, {std::string("node '") + coarser + "':", "coarser level of detail"});
    }
    EXPECT_EQ(warningsOf(levelWith({"shelf_LOD1"})), 0u) << "all that there is";
    EXPECT_EQ(warningsOf(levelWith({"shelf_LOD1", "table_LOD0"})), 0u);
}

TEST(Leftovers, WhatSaysHowItIsLitIsMeant) {
    for (const char* lighting : {"lightmap", "dynamic", "none"})
        EXPECT_EQ(warningsOf(levelWith({"UCX_shelf", "table", "table_LOD1"}, {{"dimmer_lighting", lighting}})), 0u);
    EXPECT_EQ(warningsOf(levelWith({"lucx_", "_lod1", "ucx", "my_lods1"})), 0u) << "no such names";
}

}  // namespace
}  // namespace dimmer::cook::test
