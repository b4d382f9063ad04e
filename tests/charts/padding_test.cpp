// What bilinear filtering finds beside a chart.
#include <bake/test_scenes.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <gtest/gtest.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <memory>
#include <set>

namespace dimmer::cook::test {
namespace {

// Square floors of 2 m side by side: 8 x 8 texels each, and a ring of 36 around them.
constexpr uint32_t side_texels = 8, ring_texels = 36;

struct PaddedFloors {
    Scene scene;
    std::unique_ptr<RayScene> rays;
    Unwrap charts;
    Texels texels;

    explicit PaddedFloors(Scene scene_in) : scene(std::move(scene_in)), rays(std::make_unique<RayScene>(scene)) {
        charts = unwrap(*rays, {.texels_per_metre = 4, .page_size = 64}).value();
        texels = sampleTexels(*rays, charts, 4);
    }

    // Of a floor, in the order in which they were added; two triangles each.
    const Chart& chartOf(uint32_t floor) const {
        return charts.charts[charts.face_chart[charts.front_face[2 * floor]]];
    }
    std::vector<FillTexel> ringOf(uint32_t floor) const {
        std::vector<FillTexel> ring;
        for (const FillTexel& f : texels.fills)
            if (isIn(f.address, chartOf(floor), 0)) ring.push_back(f);
        return ring;
    }
    static bool isIn(uint32_t address, const Chart& c, uint32_t margin) {
        const uint32_t x = TexelAddress::x(address), y = TexelAddress::y(address);
        return TexelAddress::page(address) == c.page && x >= c.x + margin && x < c.x + c.width - margin &&
               y >= c.y + margin && y < c.y + c.height - margin;
    }
};

// Of different regions, so that they have charts of their own.
Scene twoFloors() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    for (const uint32_t region : {1u, 2u})
        addQuad(scene, "floor", {2 * static_cast<float>(region) - 3, 0, 0}, {0, 0, 1}, {1, 0, 0}, white)
            .triangle_regions = {region, region};
    return scene;
}

// A rectangle's nearest texel is the one beside it; across a corner, the corner.
void expectCopiesItsNeighbour(const PaddedFloors& floors, uint32_t floor, const FillTexel& fill) {
    const Chart& c = floors.chartOf(floor);
    const uint32_t x = std::clamp(TexelAddress::x(fill.address), c.x + 1, c.x + c.width - 2);
    const uint32_t y = std::clamp(TexelAddress::y(fill.address), c.y + 1, c.y + c.height - 2);
    EXPECT_EQ(floors.texels.address[fill.source], TexelAddress::pack(c.page, x, y));
}

TEST(Padding, CopiesWhatLiesBesideItInTheChart) {
    Scene scene;
    addFloor(scene, 1, addMaterial(scene, lambert(0.5f)));
    const PaddedFloors floor(std::move(scene));
    const auto ring = floor.ringOf(0);
    std::set<uint32_t> places;
    for (const FillTexel& fill : ring) {
        places.insert(fill.address);
        EXPECT_FALSE(PaddedFloors::isIn(fill.address, floor.chartOf(0), 1));
        expectCopiesItsNeighbour(floor, 0, fill);
    }
    EXPECT_EQ(places.size(), ring_texels);
    EXPECT_EQ(floor.texels.fills.size(), ring_texels);
}

// Where another chart's floor goes on, its texel there fills the ring, in the same row: +X is to the right on a page.
TEST(Padding, GoesOnAcrossASeam) {
    const PaddedFloors floors(twoFloors());
    const Chart &left = floors.chartOf(0), &right = floors.chartOf(1);
    for (const uint32_t floor : {0u, 1u}) {
        const Chart &own = floor == 0 ? left : right, &other = floor == 0 ? right : left;
        const uint32_t seam_x = floor == 0 ? own.x + own.width - 1 : own.x;
        const uint32_t beyond_x = floor == 0 ? other.x + 1 : other.x + other.width - 2;
        size_t across = 0;
        for (const FillTexel& fill : floors.ringOf(floor)) {
            const uint32_t row = TexelAddress::y(fill.address) - own.y;
            const bool corner = row == 0 || row == own.height - 1;
            if (TexelAddress::x(fill.address) != seam_x || corner) {
                expectCopiesItsNeighbour(floors, floor, fill);
                continue;
            }
            ++across;
            EXPECT_EQ(floors.texels.address[fill.source], TexelAddress::pack(other.page, beyond_x, other.y + row));
        }
        EXPECT_EQ(across, side_texels);
    }
}

// A trapdoor's leaf, flush with the floor around it: open, its light is gone, and is no part of the floor's.
TEST(Padding, OfAFlushLeafIsTheFloorsOwn) {
    Scene scene = twoFloors();
    scene.doors.push_back({.name = "trap"});
    scene.meshes[1].door = 0;
    const PaddedFloors floors(std::move(scene));
    for (const uint32_t floor : {0u, 1u}) {
        const auto ring = floors.ringOf(floor);
        EXPECT_EQ(ring.size(), ring_texels);
        for (const FillTexel& fill : ring) expectCopiesItsNeighbour(floors, floor, fill);
    }
}

TEST(Padding, DoesNotReachThroughAWall) {
    Scene scene = twoFloors();
    Material sheet = lambert(0.5f);
    sheet.double_sided = true;
    addQuad(scene, "wall", {0, 0.5f, 0}, {0, 0.5f, 0}, {0, 0, 1}, addMaterial(scene, sheet));
    const PaddedFloors floors(std::move(scene));
    for (const uint32_t floor : {0u, 1u}) {
        const auto ring = floors.ringOf(floor);
        EXPECT_EQ(ring.size(), ring_texels);
        for (const FillTexel& fill : ring) expectCopiesItsNeighbour(floors, floor, fill);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
