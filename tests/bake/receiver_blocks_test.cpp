// Receivers that later bounces take together.
#include <bake/gathered_level.h>
#include <bake/receiver_blocks.h>
#include <bake/test_scenes.h>

#include <algorithm>
#include <set>

namespace dimmer::cook::test {
namespace {

glm::vec3 placeOf(const BakedScene& b, uint32_t texel) {
    return samplePoint(*b.rays, b.charts, b.texels, texel, 0).position_m;
}

Scene floorOf(glm::vec3 centre, float half) {
    Scene scene;
    addQuad(scene, "floor", centre, {half, 0, 0}, {0, 0, -half}, addMaterial(scene, lambert(0.5f)));
    return scene;
}

TEST(ReceiverBlocks, HoldEachReceiverOnceAndLieTogether) {
    const GatheredLevel level(floorOf({0, 0, 0}, 2));  // 16 x 16 texels, of which the ring of padding holds none
    const ReceiverBlocks blocks(level.gatherer);
    ASSERT_EQ(level.b.texels.size(), 256u);
    EXPECT_EQ(blocks.size(), 81u);
    std::set<uint32_t> seen;
    double area_m2 = 0;
    for (size_t block = 0; block < blocks.size(); ++block) {
        const auto receivers = blocks.receivers(block);
        ASSERT_LE(receivers.size(), 4u);
        for (const uint32_t i : receivers) {
            EXPECT_TRUE(seen.insert(i).second);
            EXPECT_EQ(blocks.of(i), block);
            EXPECT_LT(glm::distance(placeOf(level.b, i), placeOf(level.b, receivers[0])), 0.75f);
        }
        area_m2 += static_cast<double>(blocks.areasM2()[block]);
        EXPECT_NEAR(blocks.reflectance(block).y, 0.5f, 1e-6f);
    }
    EXPECT_EQ(seen.size(), 256u);
    EXPECT_NEAR(area_m2, 16, 1e-4);
}

// A plate of 2 cm stands on the floor, which is one chart still: a wall that was not cut at.
TEST(ReceiverBlocks, EndAtWhatStandsBetween) {
    for (const float at : {0.0f, 0.25f, 0.5f}) {  // between blocks, or within them
        Scene scene = floorOf({0, 0, 0}, 2);
        addSolid(scene, "wall", {at, 0.5f, 0}, {0.01f, 0.5f, 2.1f}, 0);
        const GatheredLevel level(scene);
        const ReceiverBlocks blocks(level.gatherer);
        uint32_t joined = 0;
        for (size_t block = 0; block < blocks.size(); ++block) {
            const auto receivers = blocks.receivers(block);
            joined += receivers.size() > 1;
            for (const uint32_t i : receivers) {
                if (level.b.normal(i).y < 0.5f) continue;
                EXPECT_EQ(placeOf(level.b, i).x > at, placeOf(level.b, receivers[0]).x > at) << at;
            }
        }
        EXPECT_GT(joined, 60u);
    }
}

TEST(ReceiverBlocks, LargeTexelsStayAlone) {
    const GatheredLevel level(floorOf({0, 0, 0}, 4), 1);  // texels of 1 m
    EXPECT_EQ(ReceiverBlocks(level.gatherer).size(), level.b.texels.size());
}

// What leaves the receivers of a block leaves the block.
TEST(ReceiverBlocks, SendOnWhatTheirReceiversDo) {
    const GatheredLevel level(floorOf({0, 0, 0}, 2));
    const BakedScene& b = level.b;
    SparseLight::Builder builder(b.texels.size());
    double expected_lm = 0;
    for (uint32_t i = 0; i < b.texels.size(); ++i) {
        if (i % 3 == 0) continue;
        const std::vector<TermLight> row = {
            {always_group, glm::vec3(static_cast<float>(i % 17)), Rounding(i, Rounding::Of::Direct)}};
        builder.put(i, row);
        expected_lm += static_cast<double>(b.texels.area_m2[i] * b.texels.reflectance[i].x * row[0].value().x);
    }
    const ReceiverBlocks blocks(level.gatherer);
    const SparseLight light = blocks.arriving(builder.finish(), 1);
    double lm = 0;
    for (size_t block = 0; block < blocks.size(); ++block)
        for (const TermLight& l : light.row(block))
            lm += static_cast<double>(blocks.areasM2()[block] * blocks.reflectance(block).x * l.value().x);
    // 80 blocks, each rounded at random by a quarter of a per cent: four deviations of their sum.
    EXPECT_NEAR(lm / expected_lm, 1, 4 * 0.0025 / 9);
}

// Of each path a block has as many links as its receivers on average, to the blocks of what they led to.
TEST(ReceiverBlocks, HaveASampleOfTheirReceiversLinks) {
    const GatheredLevel level(floorOf({0, 0, 0}, 2));
    const ReceiverBlocks blocks(level.gatherer);
    Links::Builder builder(level.b.texels.size());
    constexpr uint32_t each = 12;
    for (uint32_t i = 0; i < level.b.texels.size(); ++i) {
        std::vector<Link> links;
        for (uint32_t k = 0; k < each; ++k) links.push_back({(i * 7 + k * 31) % 256, k % 2});
        builder.put(i, links);
    }
    const Links of_receivers = builder.finish(), of_blocks = blocks.links(of_receivers);
    std::vector<Link> links, own;
    for (size_t block = 0; block < blocks.size(); ++block) {
        of_blocks.get(block, links);
        EXPECT_EQ(links.size(), each);
        EXPECT_EQ(std::ranges::count(links, free_path, &Link::path), each / 2);
        std::set<Link> possible;
        for (const uint32_t i : blocks.receivers(block)) {
            of_receivers.get(i, own);
            for (const Link& link : own) possible.insert({blocks.of(link.receiver), link.path});
        }
        for (const Link& link : links) EXPECT_TRUE(possible.contains(link));
    }
}

}  // namespace
}  // namespace dimmer::cook::test
