// Bad content behind good hashes: what a careless tool or an attacker writes. The table parsers and validate() must
// either refuse it or hand out data that executors can run on.
#include <dimmer/cpu_runtime.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/pack_file.h>
#include <pack/sample_pack.h>
#include <write/pack_writer.h>

#include <functional>

namespace dimmer::test {
namespace {

using cook::packBytes;
using testing::HasSubstr;

struct ContentFault {
    const char* name;
    std::function<void(PackFile&)> apply;
    std::string message;
};

// Vertices that their codec unfolds 64 times, of bytes that zstd unfolds some thousand times: 2 kB become 110 MB.
void unfoldTwice(PackFile& file) {
    constexpr uint32_t blocks = 1 << 14, block_bytes = 4 * 20, tail_bytes = 32;  // of 256 vertices
    ChunkContent& meshes = file.chunk("MODM");
    meshes.flags = 0;
    meshes.shuffle = 1;
    meshes.bytes.assign(8 + 12 * sizeof(float), {});
    meshes.write(0, 1u);
    size_t at = meshes.bytes.size();
    const auto put = [&](auto value) {
        meshes.write(at, value);
        at += sizeof value;
    };
    put(UINT32_MAX);  // no set
    put(blocks * 256);
    put(1 + blocks * block_bytes + tail_bytes);
    put(uint8_t{0xa0});
    meshes.bytes.resize(at += blocks * block_bytes + tail_bytes);
    put(0u);
    put(17u);
    put(uint8_t{0xe1});
    meshes.bytes.resize(at + 16);
}

// Byte offsets are those of docs/format.md.
const ContentFault content_faults[] = {
    {"elements: a count past the chunk", [](PackFile& f) { f.chunk("ELEM").write(0, 7u); }, "ELEM is malformed"},
    {"elements: a huge count", [](PackFile& f) { f.chunk("ELEM").write(0, UINT32_MAX); }, "ELEM is malformed"},
    {"elements: a huge name", [](PackFile& f) { f.chunk("ELEM").write(4, UINT32_MAX); }, "ELEM is malformed"},
    {"elements: bytes left over", [](PackFile& f) { f.chunk("ELEM").bytes.push_back({}); }, "ELEM is malformed"},
    {"elements: nothing at all", [](PackFile& f) { f.chunk("ELEM").bytes.clear(); }, "ELEM is malformed"},
    {"elements: a count alone", [](PackFile& f) { f.chunk("ELEM").bytes.resize(4); }, "ELEM is malformed"},
    {"elements: an unknown kind", [](PackFile& f) { f.chunk("ELEM").write(12, 9u); }, "unknown kind"},
    {"contributions: a huge count", [](PackFile& f) { f.chunk("CONT").write(0, UINT32_MAX); }, "CONT is malformed"},
    {"contributions: huge lists", [](PackFile& f) { f.chunk("CONT").write(8, 0x40000000u); }, "CONT is malformed"},
    {"contributions: a count alone", [](PackFile& f) { f.chunk("CONT").bytes.resize(4); }, "CONT is malformed"},
    {"contributions: no such set", [](PackFile& f) { f.chunk("CONT").write(4, 77u); },
     "contribution 0 has no such set"},
    {"contributions: NaN", [](PackFile& f) { f.chunk("CONT").write(20, NAN); }, "contribution 0"},
    {"contributions: other receivers", [](PackFile& f) { f.chunk("CONT").write(16, 1u); }, "bytes instead of 8;"},
    {"contributions: more receivers than there are",
     [](PackFile& f) {
         const auto addresses = static_cast<uint32_t>(f.chunk("ADDR").bytes.size() / 4);
         f.chunk("CONT").write(16, addresses + 1);
         f.chunk("PAYL", 0).bytes.resize(8 * (addresses + 1));
     },
     "contribution 0 lists"},
    // 2 pages of 32 x 32.
    {"base: half a record", [](PackFile& f) { f.chunk("BASE").bytes.pop_back(); }, "BASE ends within a record"},
    {"base: too few", [](PackFile& f) { f.chunk("BASE").bytes.resize(8); }, "BASE states 8 bytes instead of 16384"},
    {"clusters: half a record", [](PackFile& f) { f.chunk("CLUS").bytes.pop_back(); }, "CLUS ends within a record"},
    {"clusters: none", [](PackFile& f) { f.chunk("CLUS").bytes.clear(); }, "do not cover its tables"},
    {"clusters: of nobody", [](PackFile& f) { f.chunk("CLUS").write(0, 0u); }, "cluster 0 does not follow"},
    {"clusters: a huge count", [](PackFile& f) { f.chunk("CLUS").write(0, UINT32_MAX); }, "cluster 0 reaches past"},
    {"clusters: huge batches", [](PackFile& f) { f.chunk("CLUS").write(4, UINT32_MAX); }, "cluster 0 reaches past"},
    {"clusters: huge terms", [](PackFile& f) { f.chunk("CLUS").write(20, UINT32_MAX); }, "cluster 1 reaches past"},
    {"clusters: without terms", [](PackFile& f) { f.chunk("CLUS").write(8, 0u); }, "cluster"},
    {"terms: half a record", [](PackFile& f) { f.chunk("TERM").bytes.pop_back(); }, "TERM ends within a record"},
    {"terms: no such contribution", [](PackFile& f) { f.chunk("TERM").write(0, 999u); }, "names contribution 999"},
    {"terms: one too many", [](PackFile& f) { f.chunk("TERM").bytes.resize(f.chunk("TERM").bytes.size() + 4); },
     "do not cover its tables"},
    {"batches: half a record", [](PackFile& f) { f.chunk("BTCH").bytes.pop_back(); }, "BTCH ends within a record"},
    {"batches: of nobody", [](PackFile& f) { f.chunk("BTCH").write(0, 0u); }, "batch 0 does not follow"},
    {"batches: huge", [](PackFile& f) { f.chunk("BTCH").write(0, UINT32_MAX); }, "batch 0 does not follow"},
    {"addresses: half a record", [](PackFile& f) { f.chunk("ADDR").bytes.pop_back(); }, "ADDR ends within a record"},
    {"addresses: outside", [](PackFile& f) { f.chunk("ADDR").write(0, UINT32_MAX); }, "outside the pages"},
    {"payload: half a record", [](PackFile& f) { f.chunk("PAYL", 2).bytes.pop_back(); },
     "chunk PAYL 2 ends within a record"},
    {"payload: too many", [](PackFile& f) { f.chunk("PAYL", 2).bytes.resize(f.chunk("PAYL", 2).bytes.size() + 8); },
     "chunk PAYL 2 states"},
    {"meshes: a huge count", [](PackFile& f) { f.chunk("MESH").write(0, UINT32_MAX); }, "MESH is malformed"},
    {"meshes: a count alone", [](PackFile& f) { f.chunk("MESH").bytes.resize(4); }, "MESH is malformed"},
    {"meshes: cut short", [](PackFile& f) { f.chunk("MESH").bytes.pop_back(); }, "MESH is malformed"},
    {"meshes: no such page", [](PackFile& f) { f.chunk("MESH").write(13, 2u); }, "mesh 'floor' lies on page 2"},
    {"meshes: huge vertex count", [](PackFile& f) { f.chunk("MESH").write(49, 0x0fffffffu); }, "MESH is malformed"},
    {"meshes: NaN", [](PackFile& f) { f.chunk("MESH").write(53, NAN); }, "mesh 'floor' has a vertex"},
    {"viewpoints: a huge count", [](PackFile& f) { f.chunk("VIEW").write(0, UINT32_MAX); }, "VIEW is malformed"},
    {"viewpoints: a count alone", [](PackFile& f) { f.chunk("VIEW").bytes.resize(4); }, "VIEW is malformed"},
    {"viewpoints: NaN", [](PackFile& f) { f.chunk("VIEW").write(20, NAN); }, "viewpoint 'player_start'"},
    {"model meshes: a huge count", [](PackFile& f) { f.chunk("MODM").write(0, UINT32_MAX); }, "MODM is malformed"},
    {"model meshes: a count alone", [](PackFile& f) { f.chunk("MODM").bytes.resize(4); }, "MODM is malformed"},
    {"model meshes: cut short", [](PackFile& f) { f.chunk("MODM").bytes.pop_back(); }, "MODM is malformed"},
    {"model meshes: NaN", [](PackFile& f) { f.chunk("MODM").write(14, NAN); }, "the mesh of model 'barrel'"},
    {"model meshes: no such set", [](PackFile& f) { f.chunk("MODM").write(62, 4u); }, "no such light set"},
    {"model meshes: more vertices", [](PackFile& f) { f.chunk("MODM").write(66, 300u); }, "MODM is malformed"},
    {"model meshes: a huge number", [](PackFile& f) { f.chunk("MODM").write(66, UINT32_MAX); }, "MODM is malformed"},
    {"model meshes: more than their bytes unfold to", unfoldTwice, "MODM is malformed"},
    {"model meshes: another codec", [](PackFile& f) { f.chunk("MODM").write(74, std::byte{0}); }, "MODM is malformed"},
    {"models: a huge count", [](PackFile& f) { f.chunk("MODL").write(0, UINT32_MAX); }, "MODL is malformed"},
    {"models: a count alone", [](PackFile& f) { f.chunk("MODL").bytes.resize(4); }, "MODL is malformed"},
    {"models: cut short", [](PackFile& f) { f.chunk("MODL").bytes.pop_back(); }, "MODL is malformed"},
    {"models: no such mesh", [](PackFile& f) { f.chunk("MODL").write(20, 3u); }, "model 'barrel_place' has meshes"},
    {"models: too many", [](PackFile& f) { f.chunk("MODL").write(24, UINT32_MAX); }, "model 'barrel_place' has meshes"},
    {"models: no such grid", [](PackFile& f) { f.chunk("MODL").write(28, 0u); }, "'barrel_place' has a light grid"},
    {"models: NaN", [](PackFile& f) { f.chunk("MODL").write(32, NAN); }, "model 'barrel_place' stands nowhere"},
    {"settings: a huge text", [](PackFile& f) { f.chunk("SETT").write(0, UINT32_MAX); }, "SETT is malformed"},
    {"header: no pages", [](PackFile& f) { f.header.page_count = 0; }, "0 pages"},
    {"header: huge pages", [](PackFile& f) { f.header.page_width = UINT32_MAX; }, "pages of 4294967295"},
    {"header: other pages", [](PackFile& f) { f.header.page_height = 31; }, "BASE states 16384 bytes instead of 15872"},
    {"header: colour", [](PackFile& f) { f.header.color_format = 2; }, "its colour format 2 is unknown"},
    {"header: direction", [](PackFile& f) { f.header.direction_model = 2; }, "its directional model 2 is unknown"},
    {"header: NaN", [](PackFile& f) { f.header.exposure = NAN; }, "its exposure is nan"},
};

TEST(PackContent, FaultsAreNamed) {
    const PackFile good(packBytes(samplePack()));
    ASSERT_TRUE(Pack::fromBytes(good.bytes(), "test").has_value());
    for (const ContentFault& fault : content_faults) {
        PackFile file = good;
        fault.apply(file);
        const auto pack = Pack::fromBytes(file.bytes(), "level.dimmer");
        ASSERT_FALSE(pack.has_value()) << fault.name;
        EXPECT_EQ(pack.error().code, ErrorCode::BadInput) << fault.name;
        EXPECT_THAT(pack.error().message, HasSubstr(fault.message)) << fault.name;
        EXPECT_THAT(pack.error().message, testing::StartsWith("level.dimmer: ")) << fault.name;
    }
}

void mutate(ChunkContent& chunk, Random& random) {
    auto& bytes = chunk.bytes;
    const uint32_t words[] = {0,          1,          63,         64,         65,   0x7fffffff,
                              0x80000000, 0x7fc00000, UINT32_MAX, 0x3f800000, 4096, static_cast<uint32_t>(random())};
    const uint32_t last_word = std::size(words) - 1;
    switch (bytes.empty() ? 4 : pick(random, 0, 4)) {
        case 0:  // a 32-bit word in its place
        case 1:
            if (bytes.size() >= 4)
                chunk.write(4 * pick(random, 0, static_cast<uint32_t>(bytes.size() / 4) - 1),
                            words[pick(random, 0, last_word)]);
            break;
        case 2:
            bytes[random() % bytes.size()] ^= std::byte{1} << pick(random, 0, 7);
            break;
        case 3:
            bytes.resize(random() % bytes.size());
            break;
        case 4:
            bytes.resize(bytes.size() + pick(random, 1, 64));
            break;
    }
}

// Everything that an executor and a tool do with a pack.
void run(const Pack& pack) {
    CpuRuntime runtime(pack);
    EXPECT_LE(runtime.update().receivers, pack.data().addresses.size());
    for (uint32_t e = 0; e < pack.elements().size(); ++e) {
        const bool set = pack.elements()[e].kind == ElementKind::LightSet;
        EXPECT_TRUE(set ? runtime.setWeight({e}, 0) : runtime.setDoor({e}, 1));
    }
    EXPECT_LE(runtime.update().receivers, pack.data().addresses.size());
    for (const Mesh& mesh : pack.meshes())
        for (const MeshVertex& v : mesh.vertices)
            sampleLightmap(pack, runtime.irradiancePages(), runtime.directionPages(), mesh.page, v.lightmap_uv,
                           {0, 0, 1});
    for (const ModelMesh& mesh : pack.modelMeshes())
        for (const uint32_t i : mesh.indices) {
            EXPECT_TRUE(std::isfinite(modelNormal(mesh.vertices[i])[0]));
            modelPosition(mesh, mesh.vertices[i]);
        }
    for (const PlacedModel& model : pack.models())
        for (uint32_t m = 0; m < model.mesh_count; ++m)
            for (const ModelVertex& v : pack.modelMeshes()[model.first_mesh + m].vertices)
                modelTransfer(v, model.world_from_model);
}

// Whatever is accepted must be safe to run: the sanitizers watch the second half of this test.
TEST(PackContent, RandomFaultsAreRefusedOrHarmless) {
    const PackFile good(packBytes(samplePack()));
    int refused = 0, accepted = 0;
    for (uint32_t seed = 0; seed < 3000; ++seed) {
        Random random(seed);
        PackFile file = good;
        const uint32_t count = pick(random, 1, 3);
        for (uint32_t i = 0; i < count; ++i) mutate(file.chunks[random() % file.chunks.size()], random);
        const auto pack = Pack::fromBytes(file.bytes(), "test");
        if (!pack) {
            ++refused;
            EXPECT_EQ(pack.error().code, ErrorCode::BadInput) << seed;
            EXPECT_GT(pack.error().message.size(), 20u) << seed;
            continue;
        }
        ++accepted;
        run(*pack);
    }
    // Both happen often, or the test looks at nothing.
    EXPECT_GT(refused, 300);
    EXPECT_GT(accepted, 300);
}

}  // namespace
}  // namespace dimmer::test
