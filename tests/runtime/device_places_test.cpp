// Where the device finds a batch's texels.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <gmock/gmock.h>
#include <pack/batches.h>
#include <update/device_places.h>

#include "gpu_fixture.h"
#include "pages.h"

namespace dimmer {
namespace {

using testing::ElementsAre;

// Of a page with 512 tiles to a row.
uint32_t addressIn(uint32_t tile, uint32_t x = 0, uint32_t y = 0) {
    return TexelAddress::pack(0, (tile & 511) * tile_side + x, (tile >> 9) * tile_side + y);
}

std::vector<uint32_t> wholeTiles(const std::vector<uint32_t>& tiles) {
    std::vector<uint32_t> addresses;
    for (const uint32_t tile : tiles)
        for (uint32_t i = 0; i < tile_side * tile_side; ++i)
            addresses.push_back(addressIn(tile, i % tile_side, i / tile_side));
    return addresses;
}

// A page whose `addresses` are one cluster, of one light set.
PackData packAt(const std::vector<uint32_t>& addresses, uint32_t width, uint32_t height) {
    test::Random random(3);
    PackData data;
    data.page_width = width, data.page_height = height, data.page_count = 1;
    const auto count = static_cast<uint32_t>(addresses.size());
    data.elements.push_back({"lamp", ElementKind::LightSet, 1});
    data.contributions.push_back({0, {}, {}, count, 0});
    data.base_pages.resize(size_t{width} * height);
    for (TexelRecord& record : data.base_pages) record = test::randomRecord(random, 1);
    for (uint32_t i = 0; i < count; ++i) data.payload.push_back(test::randomRecord(random, 1));
    data.addresses = addresses;
    data.terms.push_back({0, 0});
    cutIntoBatches(data.addresses, width, 0, data.batches);
    data.clusters.push_back({0, count, 0, static_cast<uint32_t>(data.batches.size()), 0, 1});
    return data;
}

std::vector<uint32_t> sizesOf(const std::vector<Batch>& batches) {
    std::vector<uint32_t> sizes;
    for (const Batch& batch : batches) sizes.push_back(batch.receiver_count);
    return sizes;
}

TEST(DevicePlaces, WholeTilesShareTheirPlaces) {
    const auto places = placesOf(packAt(wholeTiles({0, 1, 2, 512, 513, 514}), 24, 16));
    EXPECT_EQ(places.batches.size(), 6u);
    EXPECT_EQ(places.bytes.size(), 64u);
    EXPECT_EQ(places.receivers, 6 * 64u);
}

// Shifted by ten texels every batch but the last has the same two parts of tiles.
TEST(DevicePlaces, SoDoBatchesThatLieAlike) {
    auto addresses = wholeTiles({0, 1, 2, 3});
    addresses.erase(addresses.begin(), addresses.begin() + 10);
    const auto places = placesOf(packAt(addresses, 32, 8));
    EXPECT_EQ(places.batches.size(), 4u);
    EXPECT_EQ(places.bytes.size(), 64u + 54);
}

// An odd last batch is padded: its twin of one receiver more, at the first texel, lies alike.
TEST(DevicePlaces, AnOddBatchTakesAnEvenNumberOfPlaces) {
    const auto places = placesOf(packAt({addressIn(0, 3), addressIn(0, 4), addressIn(0, 5)}, 8, 8));
    EXPECT_EQ(places.bytes, (std::vector<uint8_t>{3, 4, 5, 0}));
    EXPECT_EQ(places.receivers, 4u);
}

TEST(DevicePlaces, AnyTwoTilesMakeABatchAndOthersSoonFollow) {
    const uint32_t last = 512 * 512 - 1;
    const auto sizes = [](const std::vector<uint32_t>& tiles) {
        std::vector<uint32_t> addresses;
        for (const uint32_t tile : tiles) addresses.insert(addresses.end(), {addressIn(tile), addressIn(tile, 1)});
        std::vector<Batch> batches;
        cutIntoBatches(addresses, page_side_max, 0, batches);
        return sizesOf(batches);
    };
    EXPECT_THAT(sizes({0, last}), ElementsAre(4));
    EXPECT_THAT(sizes({last, 0, 4095, 8190}), ElementsAre(8));
    EXPECT_THAT(sizes({last, 0, 4096}), ElementsAre(4, 2));
    EXPECT_THAT(sizes({0, 1, 2, 4098}), ElementsAre(6, 2));
    EXPECT_THAT(sizes({2, 1, 0}), ElementsAre(4, 2));
    EXPECT_THAT(sizes({3, 2, 3, 2}), ElementsAre(8)) << "two tiles in turns";
    EXPECT_THAT(sizes({0, 1, 2, 3, 4}), ElementsAre(8, 2));
}

// Of a narrow page rows count for less: tiles are numbered in rows of a power of two.
TEST(DevicePlaces, RowsOfNarrowPagesAreShort) {
    const auto cut = [](uint32_t page_width, uint32_t rows) {
        std::vector<uint32_t> addresses;
        for (const uint32_t row : {0u, 1u, 1 + rows})
            for (const uint32_t x : {0u, 1u}) addresses.push_back(TexelAddress::pack(0, x, row * tile_side));
        std::vector<Batch> batches;
        cutIntoBatches(addresses, page_width, 0, batches);
        return batches.size();
    };
    EXPECT_EQ(cut(4096, 7), 1u);
    EXPECT_EQ(cut(4096, 8), 2u);
    EXPECT_EQ(cut(2049, 8), 2u);
    EXPECT_EQ(cut(2048, 15), 1u);
    EXPECT_EQ(cut(2048, 16), 2u);
    EXPECT_EQ(cut(1, 510), 1u);
}

class DevicePlacesGpu : public test::GpuTest {};

// Steps with every bit set and none, from first tiles at either end: the kernel's bits of places against addresses.
TEST_F(DevicePlacesGpu, GpuFindsTilesAsFarApartAsABatchMayHave) {
    std::vector<uint32_t> addresses;
    uint32_t shift = 0;  // each batch has places of its own
    for (const auto& tiles : {std::array{0u, 8704u, 8705u, 9215u}, {8703u, 5u, 4100u, 8195u}, {1u, 3u, 4098u, 4099u}}) {
        for (const uint32_t tile : tiles)
            for (uint32_t i = 0; i < 16; ++i) addresses.push_back(addressIn(tile, (7 - i % 4 + shift) % 8, i / 2));
        ++shift;
    }
    const Pack pack = test::packOf(packAt(addresses, page_side_max, 18 * tile_side));
    ASSERT_THAT(sizesOf(pack.data().batches), ElementsAre(64, 64, 64));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    for (const char* state : {"lamp=1", "lamp=0.3", ""}) {
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        const auto pages = gpu.readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        EXPECT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages())) << state;
        EXPECT_TRUE(std::ranges::equal(pages->direction, cpu.directionPages())) << state;
    }
}

}  // namespace
}  // namespace dimmer
