// What longer texels would lose, against values by hand.
#include <gtest/gtest.h>
#include <pack/pack_data.h>
#include <pipeline/coarser_texels.h>

namespace dimmer::cook::test {
namespace {

constexpr uint32_t width = 8, height = 4;

// A chart of width x height texels at (16, 24).
Texels oneChart() {
    Texels texels;
    for (uint32_t i = 0; i < width * height; ++i) {
        texels.address.push_back(TexelAddress::pack(0, 16 + i % width, 24 + i / width));
        texels.first_sample.push_back(i);
        texels.samples.push_back({});
        texels.area_m2.push_back(0.25f);
    }
    texels.first_sample.push_back(width * height);
    return texels;
}

std::vector<float> luxOf(auto&& of_column) {
    std::vector<float> lux;
    for (uint32_t i = 0; i < width * height; ++i) lux.push_back(of_column(i % width));
    return lux;
}

const std::vector<uint32_t> face_chart = {0};

// 1 lux left of the middle and none to the right of it, twice as long texels: of those at the edge the left one holds
// 1, and is shown as 1 and 3/4, 7/8 in the mean, so that sharpening makes it 9/8; the right one cannot go below 0.
// Shown are then, from the third texel on, 33/32, 35/32 and 27/32, and beyond the edge 9/32. Losses over light and a
// floor of 1 lux: 1/64 + 3/64 + 5/64 + 18/64.
TEST(CoarserTexels, LoseAnEdgeAsByHand) {
    const auto lux = luxOf([](uint32_t x) { return x < width / 2 ? 1.0f : 0.0f; });
    const CoarserTexels coarser(oneChart(), face_chart, {false}, lux, 1);
    EXPECT_NEAR(coarser.error(2), 27.0 / 64 / width, 1e-6);
}

TEST(CoarserTexels, LoseNothingWhereLightIsEven) {
    const CoarserTexels coarser(oneChart(), face_chart, {false}, luxOf([](uint32_t) { return 3.0f; }), 0.1f);
    for (const double factor : {1.0, 1.3, 2.0, 5.0, 100.0}) EXPECT_NEAR(coarser.error(factor), 0, 1e-6) << factor;
}

TEST(CoarserTexels, LoseNothingWhereTheDensityIsFixed) {
    const auto lux = luxOf([](uint32_t x) { return static_cast<float>(x % 3); });
    EXPECT_GT(CoarserTexels(oneChart(), face_chart, {false}, lux, 1).error(2), 0.1);
    EXPECT_EQ(CoarserTexels(oneChart(), face_chart, {true}, lux, 1).error(2), 0);
}

}  // namespace
}  // namespace dimmer::cook::test
