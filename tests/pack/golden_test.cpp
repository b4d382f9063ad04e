// Packs written by the builds of every format version so far (tests/golden/pack_v*.dimmer, the same small content in
// each): read, or refused by version. A new version adds a file, written by the build that introduced it.
#include <dimmer/cpu_runtime.h>
#include <format/hash.h>
#include <format/layout.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/pack_data.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace dimmer {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Expected<Pack> openGolden(uint32_t version) {
    return Pack::open(fmt::format("{}/tests/golden/pack_v{}.dimmer", DIMMER_SOURCE_DIR, version));
}

// Of values as they were when the file was written.
uint64_t hashOf(const auto& values) {
    return format::chunkHash(std::as_bytes(std::span(values)));
}

// Since version 8, whose tetrahedra are told by each other.
void expectGrids(const ProbeData& probes) {
    EXPECT_EQ(hashOf(probes.base), 5338456095402337698u);
    EXPECT_EQ(hashOf(probes.numbers), 11401258628283044530u);
    EXPECT_EQ(hashOf(probes.payload), 15134233505589573710u);
    EXPECT_EQ(hashOf(probes.global.positions), 7384791458399739505u);
    EXPECT_EQ(hashOf(probes.global.levels), 3416448411842548136u);
    EXPECT_EQ(hashOf(probes.global.tetrahedra), 4890589981881953613u);
    EXPECT_EQ(hashOf(probes.global.visibility), 3825913768731029766u);
    EXPECT_EQ(hashOf(probes.global.starts), 16100192548216535724u);
    ASSERT_EQ(probes.local.size(), 1u);
    EXPECT_EQ(probes.local[0].counts, (std::array<uint32_t, 3>{2, 2, 2}));
}

void expectContent(const Pack& pack) {
    EXPECT_EQ(pack.exposure(), 0.5f);
    ASSERT_EQ(pack.elements().size(), 2u);
    EXPECT_EQ(pack.elements()[0].name, "hall");
    EXPECT_EQ(pack.elements()[1].name, "front");
    ASSERT_EQ(pack.contributions().size(), 2u);
    EXPECT_EQ(pack.contributions()[0].receivers, 2u);
    EXPECT_EQ(pack.contributions()[1].doors_open, std::vector{1u});
    ASSERT_EQ(pack.meshes().size(), 1u);
    EXPECT_EQ(pack.meshes()[0].node, "floor");
    EXPECT_EQ(pack.viewpoints()[0].position_m, (std::array<float, 3>{1, 2, 3}));
    ASSERT_EQ(pack.models().size(), 2u);
    EXPECT_EQ(pack.models()[0].node, "barrel_place");
    ASSERT_EQ(pack.models()[1].mesh_count, 2u);
    const ModelMesh& barrel = pack.modelMeshes()[0];
    EXPECT_EQ(barrel.indices, (std::vector<uint32_t>{0, 1, 2, 2, 1, 3, 2, 3, 4}));
    // 13000 steps of 2 m / 65535, and what the bytes 127 and -127 stand for.
    EXPECT_NEAR(modelPosition(barrel, barrel.vertices[1])[1], 0.3967346f, 1e-6f);
    EXPECT_EQ(modelTransfer(barrel.vertices[0], {}).coefficients[0], transfer_bounds[0]);
    EXPECT_EQ(modelTransfer(barrel.vertices[0], {}).coefficients[1], -transfer_bounds[1]);
    expectGrids(pack.data().probes);
    CpuRuntime runtime(pack);
    ASSERT_TRUE(runtime.apply("hall=0.5,door:front=1"));
    EXPECT_EQ(runtime.update().receivers, 2u + 20);  // texels and probes
}

TEST(PackGolden, EveryVersionIsReadOrRefusedByName) {
    for (uint32_t version = 1; version <= format::version; ++version) {
        SCOPED_TRACE(version);
        const auto pack = openGolden(version);
        if (pack) {
            expectContent(*pack);
            continue;
        }
        EXPECT_NE(version, format::version) << pack.error().message;
        EXPECT_EQ(pack.error().code, ErrorCode::BadInput);
        EXPECT_THAT(
            pack.error().message,
            AllOf(HasSubstr(fmt::format("pack_v{}.dimmer", version)),
                  HasSubstr(fmt::format("of format version {}, this build reads version {}", version, format::version)),
                  HasSubstr("cook the level again with this build")));
    }
}

TEST(PackGolden, TheFormatsPageHasTheVersionThatIsWritten) {
    std::ifstream file(std::filesystem::path(DIMMER_SOURCE_DIR) / "docs/format.md");
    const std::string page(std::istreambuf_iterator<char>(file), {});
    EXPECT_THAT(page, HasSubstr(fmt::format("| 8 | u32 | version | {}; a reader", format::version)));
    EXPECT_THAT(page, HasSubstr(fmt::format("\n| {} | ", format::version)));
}

}  // namespace
}  // namespace dimmer
