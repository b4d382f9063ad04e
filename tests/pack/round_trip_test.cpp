// What is written is what is read, and its bytes are what docs/format.md says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/pack_file.h>
#include <pack/sample_pack.h>
#include <write/pack_writer.h>
#include <xxhash.h>

#include <cstring>

namespace dimmer::test {
namespace {

using cook::packBytes;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

template <class T>
T at(const std::vector<std::byte>& bytes, size_t offset) {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof(T));
    return value;
}

template <class T>
void expectSameBytes(const std::vector<T>& a, const std::vector<T>& b, const char* what) {
    static_assert(std::is_trivially_copyable_v<T>);
    ASSERT_EQ(a.size(), b.size()) << what;
    EXPECT_TRUE(a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0) << what;
}

void expectEqual(const Mesh& a, const Mesh& b) {
    EXPECT_EQ(a.node, b.node);
    EXPECT_EQ(a.page, b.page);
    EXPECT_EQ(a.door, b.door);
    EXPECT_EQ(a.reflectance, b.reflectance);
    EXPECT_EQ(a.emission_cd_m2, b.emission_cd_m2);
    EXPECT_EQ(a.emission_set, b.emission_set);
    expectSameBytes(a.vertices, b.vertices, "vertices");
    EXPECT_EQ(a.indices, b.indices);
}

void expectEqual(const ModelMesh& a, const ModelMesh& b) {
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.min_m, b.min_m);
    EXPECT_EQ(a.max_m, b.max_m);
    EXPECT_EQ(a.reflectance, b.reflectance);
    EXPECT_EQ(a.emission_cd_m2, b.emission_cd_m2);
    EXPECT_EQ(a.emission_set, b.emission_set);
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.indices, b.indices);
}

void expectEqual(const PackData& a, const PackData& b) {
    EXPECT_EQ(a.exposure, b.exposure);
    EXPECT_EQ(a.color_format, b.color_format);
    EXPECT_EQ(a.direction_model, b.direction_model);
    EXPECT_EQ(a.page_width, b.page_width);
    EXPECT_EQ(a.page_height, b.page_height);
    EXPECT_EQ(a.page_count, b.page_count);
    ASSERT_EQ(a.elements.size(), b.elements.size());
    for (size_t i = 0; i < a.elements.size(); ++i) {
        EXPECT_EQ(a.elements[i].name, b.elements[i].name);
        EXPECT_EQ(a.elements[i].kind, b.elements[i].kind);
        EXPECT_EQ(a.elements[i].max_weight, b.elements[i].max_weight);
    }
    ASSERT_EQ(a.contributions.size(), b.contributions.size());
    for (size_t i = 0; i < a.contributions.size(); ++i) {
        EXPECT_EQ(a.contributions[i].light_set, b.contributions[i].light_set);
        EXPECT_EQ(a.contributions[i].doors_open, b.contributions[i].doors_open);
        EXPECT_EQ(a.contributions[i].doors_closed, b.contributions[i].doors_closed);
        EXPECT_EQ(a.contributions[i].receivers, b.contributions[i].receivers);
        EXPECT_EQ(a.contributions[i].energy_dropped, b.contributions[i].energy_dropped);
    }
    expectSameBytes(a.base_pages, b.base_pages, "base");
    expectSameBytes(a.clusters, b.clusters, "clusters");
    expectSameBytes(a.terms, b.terms, "terms");
    expectSameBytes(a.batches, b.batches, "batches");
    expectSameBytes(a.addresses, b.addresses, "addresses");
    expectSameBytes(a.payload, b.payload, "payload");
    ASSERT_EQ(a.meshes.size(), b.meshes.size());
    for (size_t i = 0; i < a.meshes.size(); ++i) expectEqual(a.meshes[i], b.meshes[i]);
    ASSERT_EQ(a.viewpoints.size(), b.viewpoints.size());
    for (size_t i = 0; i < a.viewpoints.size(); ++i) {
        EXPECT_EQ(a.viewpoints[i].name, b.viewpoints[i].name);
        EXPECT_EQ(a.viewpoints[i].position_m, b.viewpoints[i].position_m);
        EXPECT_EQ(a.viewpoints[i].forward, b.viewpoints[i].forward);
        EXPECT_EQ(a.viewpoints[i].vertical_fov_rad, b.viewpoints[i].vertical_fov_rad);
    }
    ASSERT_EQ(a.model_meshes.size(), b.model_meshes.size());
    for (size_t i = 0; i < a.model_meshes.size(); ++i) expectEqual(a.model_meshes[i], b.model_meshes[i]);
    ASSERT_EQ(a.models.size(), b.models.size());
    for (size_t i = 0; i < a.models.size(); ++i) {
        EXPECT_EQ(a.models[i].node, b.models[i].node);
        EXPECT_EQ(a.models[i].first_mesh, b.models[i].first_mesh);
        EXPECT_EQ(a.models[i].mesh_count, b.models[i].mesh_count);
        EXPECT_EQ(a.models[i].local_grid, b.models[i].local_grid);
        EXPECT_EQ(a.models[i].world_from_model.rows, b.models[i].world_from_model.rows);
        EXPECT_EQ(a.models[i].min_m, b.models[i].min_m);
        EXPECT_EQ(a.models[i].max_m, b.models[i].max_m);
    }
    EXPECT_EQ(a.settings_json, b.settings_json);
}

void expectRoundTrip(const PackData& data) {
    const auto pack = Pack::fromBytes(packBytes(data), "test");
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    expectEqual(data, pack->data());
}

TEST(PackRoundTrip, EveryField) {
    for (uint32_t seed = 1; seed <= 5; ++seed) expectRoundTrip(samplePack(seed));
}

TEST(PackRoundTrip, EveryFormatOfPages) {
    for (const ColorFormat color : {ColorFormat::R11G11B10F, ColorFormat::E5B9G9R9})
        for (const DirectionModel model : {DirectionModel::Ahd, DirectionModel::Linear}) {
            PackData data = samplePack();
            data.color_format = color;
            data.direction_model = model;
            expectRoundTrip(data);
            // As docs/format.md numbers them.
            const auto bytes = packBytes(data);
            EXPECT_EQ(at<uint32_t>(bytes, 52), color == ColorFormat::E5B9G9R9 ? 1u : 0u);
            EXPECT_EQ(at<uint32_t>(bytes, 56), model == DirectionModel::Linear ? 1u : 0u);
        }
}

TEST(PackRoundTrip, ThroughAFile) {
    const PackData data = samplePack();
    const auto path = std::filesystem::temp_directory_path() / fmt::format("dimmer_round_trip_{}", getpid());
    ASSERT_TRUE(cook::writeFileAtomically(path, packBytes(data)));
    const auto pack = Pack::open(path);
    std::filesystem::remove(path);
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    expectEqual(data, pack->data());
}

TEST(PackRoundTrip, ALevelWithoutAnythingThatChanges) {
    PackData data;
    data.page_count = 1;
    data.page_width = 5;
    data.page_height = 3;
    data.base_pages.resize(15, {7, 8});
    expectRoundTrip(data);
}

TEST(PackRoundTrip, NamesMayHoldAnyBytes) {
    PackData data = samplePack();
    data.elements[0].name =
        "K\xc3\xbc"
        "che \"1\"";
    data.elements[1].name = std::string("a\0b\xff", 4);
    expectRoundTrip(data);
}

// The decoder grows its output in steps of 64 KiB; sizes around them, and pages that compress to almost nothing.
TEST(PackRoundTrip, LargeAndEvenContent) {
    for (const size_t size : {65535, 65536, 65537, 1 << 20}) {
        PackData data = samplePack();
        data.settings_json.assign(size, 'x');
        expectRoundTrip(data);
        Random random(static_cast<uint32_t>(size));
        for (char& c : data.settings_json) c = static_cast<char>(random());
        expectRoundTrip(data);
    }
    PackData empty_pages;
    empty_pages.page_count = 4;
    empty_pages.page_width = empty_pages.page_height = 1024;
    empty_pages.base_pages.resize(4 * 1024 * 1024, {0, 255});
    expectRoundTrip(empty_pages);
}

TEST(PackRoundTrip, TheSameDataGivesTheSameBytes) {
    const auto bytes = packBytes(samplePack(7));
    EXPECT_EQ(bytes, packBytes(samplePack(7)));
    EXPECT_NE(bytes, packBytes(samplePack(8)));
    // Reading and writing again changes nothing either.
    const auto pack = Pack::fromBytes(bytes, "test");
    ASSERT_TRUE(pack.has_value());
    EXPECT_EQ(bytes, packBytes(pack->data()));
}

// Offsets as docs/format.md lists them.
TEST(PackLayout, HeaderAndTable) {
    const PackData data = samplePack();
    const auto bytes = packBytes(data);
    EXPECT_EQ(std::memcmp(bytes.data(), "DIMMER\r\n", 8), 0);
    EXPECT_EQ(at<uint32_t>(bytes, 8), format::version);
    EXPECT_EQ(std::to_integer<int>(bytes[12]), 4);  // 0x01020304, the lowest byte first
    EXPECT_EQ(at<uint64_t>(bytes, 16), bytes.size());
    EXPECT_EQ(at<float>(bytes, 32), data.exposure);
    EXPECT_EQ(at<uint32_t>(bytes, 36), 32u);
    EXPECT_EQ(at<uint32_t>(bytes, 40), 32u);
    EXPECT_EQ(at<uint32_t>(bytes, 44), 2u);
    const uint32_t count = at<uint32_t>(bytes, 48);
    EXPECT_EQ(count, 12 + data.contributions.size());

    auto hashed = bytes;
    hashed.resize(64 + 48 * count);
    std::memset(hashed.data() + 24, 0, 8);
    EXPECT_EQ(at<uint64_t>(bytes, 24), XXH64(hashed.data(), hashed.size(), 0));
    uint64_t end = hashed.size();
    for (uint32_t i = 0; i < count; ++i) {
        const size_t entry = 64 + 48 * i;
        const auto offset = at<uint64_t>(bytes, entry + 16), stored = at<uint64_t>(bytes, entry + 24);
        EXPECT_EQ(offset % 64, 0u);
        EXPECT_GE(offset, end);
        EXPECT_LT(offset, end + 64);
        end = offset + stored;
        EXPECT_EQ(at<uint64_t>(bytes, entry + 40), XXH64(bytes.data() + offset, stored, 0));
    }
    EXPECT_EQ(end, bytes.size());
}

TEST(PackLayout, TablesAndArrays) {
    const PackData data = samplePack();
    PackFile file(packBytes(data));
    const auto& elements = file.chunk("ELEM");
    EXPECT_EQ(elements.read<uint32_t>(0), 6u);
    EXPECT_EQ(elements.read<uint32_t>(4), 4u);  // the length of "set0"
    EXPECT_EQ(std::memcmp(elements.bytes.data() + 8, "set0", 4), 0);
    EXPECT_EQ(elements.read<uint32_t>(12), 0u);  // a light set
    EXPECT_EQ(elements.read<float>(16), 2.0f);
    EXPECT_EQ(file.chunk("BASE").shuffle, 8u);
    EXPECT_EQ(file.chunk("BASE").bytes.size(), data.base_pages.size() * 8);
    EXPECT_EQ(file.chunk("CLUS").bytes.size(), data.clusters.size() * 12);
    EXPECT_EQ(file.chunk("CLUS").read<uint32_t>(12), data.clusters[1].receiver_count);
    EXPECT_EQ(file.chunk("TERM").bytes.size(), data.terms.size() * 4);
    EXPECT_EQ(file.chunk("TERM").read<uint32_t>(4), data.terms[1].contribution);
    EXPECT_EQ(file.chunk("BTCH").bytes.size(), data.batches.size() * 4);
    EXPECT_EQ(file.chunk("BTCH").read<uint32_t>(4), data.batches[1].receiver_count);
    EXPECT_EQ(file.chunk("ADDR").bytes.size(), data.addresses.size() * 4);
    size_t first = 0;
    for (uint32_t k = 0; k < data.contributions.size(); ++k) {
        const auto& payload = file.chunk("PAYL", k);
        ASSERT_EQ(payload.bytes.size(), data.contributions[k].receivers * sizeof(TexelRecord));
        if (payload.bytes.empty()) continue;
        EXPECT_EQ(payload.read<uint32_t>(0), data.payload[first].irradiance);
        EXPECT_EQ(payload.read<uint32_t>(4), data.payload[first].direction);
        first += data.contributions[k].receivers;
    }
    EXPECT_EQ(first, data.payload.size());
}

// The tests' own writer makes packs that are as good as the product's.
TEST(PackLayout, AnotherWriterOfTheSameFormatIsUnderstood) {
    const PackData data = samplePack();
    const auto pack = Pack::fromBytes(PackFile(packBytes(data)).bytes(), "test");
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    expectEqual(data, pack->data());
}

// A writer may choose differences for any chunk, and for none.
TEST(PackLayout, DifferencesAreForTheWriterToChoose) {
    const PackData data = samplePack();
    PackFile file(packBytes(data));
    EXPECT_EQ(file.chunk("PAYL").flags, format::chunk_delta);
    EXPECT_EQ(file.chunk("MESH").flags, 0u);
    for (ChunkContent& c : file.chunks) c.flags ^= format::chunk_delta;
    const auto pack = Pack::fromBytes(file.bytes(), "test");
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    expectEqual(data, pack->data());
}

TEST(PackLayout, UnknownChunksAreSkippedOnlyWhenOptional) {
    const PackData data = samplePack();
    PackFile file(packBytes(data));
    file.chunks.insert(file.chunks.begin(),
                       {format::fourcc("XTRA"), format::chunk_optional, 3, 1, {std::byte{1}}, UINT64_MAX, {}});
    const auto pack = Pack::fromBytes(file.bytes(), "test");
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    expectEqual(data, pack->data());

    file.chunks.front().flags = 0;
    const auto refused = Pack::fromBytes(file.bytes(), "test");
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::BadInput);
    EXPECT_THAT(refused.error().message, HasSubstr("XTRA"));
}

}  // namespace
}  // namespace dimmer::test
