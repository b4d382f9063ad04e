// Damaged packs and levels through the real tool: an error message and exit code 2, never a crash.
#include <app/tool_fixture.h>
#include <pack/pack_file.h>
#include <runtime/random_pack.h>

namespace dimmer::test {
namespace {

using testing::HasSubstr;

struct DamagedFiles : ToolTest {
    static void expectRefused(const ProcessResult& result, const std::string& file_name, const std::string& context) {
        EXPECT_EQ(result.exit_code, 2) << context << "\n" << result.err;
        EXPECT_THAT(result.err, HasSubstr("dimmer: error: ")) << context;
        EXPECT_THAT(result.err, HasSubstr(file_name)) << context;
        EXPECT_THAT(result.out, testing::IsEmpty()) << context;
    }
};

TEST_F(DamagedFiles, TruncatedPacks) {
    const std::string whole = readText(pack());
    for (size_t i = 0; i < 20; ++i) {
        write("cut.dimmer", whole.substr(0, whole.size() * i / 20));
        expectRefused(runDimmer({"inspect", file("cut.dimmer")}), "cut.dimmer", fmt::format("{} of 20", i));
    }
}

TEST_F(DamagedFiles, FlippedBitsInPacks) {
    const std::string whole = readText(pack());
    uint32_t chunks = 0;
    std::memcpy(&chunks, whole.data() + 48, sizeof(chunks));
    Random random(11);
    const std::string points = write("points.csv", "x,y,z,nx,ny,nz\n1,0,1,0,1,0\n");
    for (int i = 0; i < 20; ++i) {
        std::string damaged = whole;
        // In the header and the table, or in the middle of a chunk: padding between chunks is nobody's.
        size_t byte = pick(random, 0, 63 + 48 * chunks);
        if (i % 2) {
            format::Chunk c;
            std::memcpy(&c, whole.data() + 64 + 48 * pick(random, 0, chunks - 1), sizeof(c));
            byte = c.offset + random() % c.stored_bytes;
        }
        damaged[byte] = static_cast<char>(damaged[byte] ^ 1 << pick(random, 0, 7));
        write("flipped.dimmer", damaged);
        expectRefused(runDimmer({"sample", file("flipped.dimmer"), "--points", points}), "flipped.dimmer",
                      fmt::format("byte {}", byte));
    }
    write("empty.dimmer", "");
    for (const char* command : {"inspect", "bench"})
        expectRefused(runDimmer({command, file("empty.dimmer")}), "empty.dimmer", command);
}

// Settings are text that a reader must not trust either.
TEST_F(DamagedFiles, PacksWithStrangeSettings) {
    const std::string whole = readText(pack());
    const std::string nested = std::string(200000, '[') + std::string(200000, ']');
    for (const std::string& settings :
         {std::string(), std::string("[1, 2]"), std::string("{\"a\": 3, \"b\": {\"value\": {}, \"from\": 1}}"), nested,
          "{\"a\": {\"value\": " + nested + ", \"from\": \"x\"}}", std::string("\xff\xfe")}) {
        PackFile changed(std::as_bytes(std::span(whole)));
        ChunkContent& chunk = changed.chunk("SETT");
        chunk.bytes.clear();
        chunk.write(0, static_cast<uint32_t>(settings.size()));
        const auto raw = std::as_bytes(std::span(settings));
        chunk.bytes.insert(chunk.bytes.end(), raw.begin(), raw.end());
        const auto bytes = changed.bytes();
        write("settings.dimmer", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
        for (const char* option : {"--json", "--settings"}) {
            const auto result = runDimmer({"inspect", file("settings.dimmer"), option});
            EXPECT_EQ(result.exit_code, 0) << settings.substr(0, 50) << result.err;
        }
        EXPECT_EQ(json::parse(runDimmer({"inspect", file("settings.dimmer"), "--json"}).out)["settings"],
                  json::object());
        EXPECT_EQ(runDimmer({"report", file("settings.dimmer"), "-o", file("settings.html")}).exit_code, 0);
    }
}

TEST_F(DamagedFiles, TruncatedLevels) {
    const std::string text = readText(file("level.gltf"));
    const auto bytes = cook::test::twoCells().glb();
    const std::string binary(bytes.begin(), bytes.end());
    for (const auto& [name, whole] : {std::pair{"cut.gltf", text}, {"cut.glb", binary}})
        for (size_t i = 0; i < 8; ++i) {
            write(name, whole.substr(0, whole.size() * i / 8));
            expectRefused(cook("never.dimmer", {}, name), name, fmt::format("{} of 8", i));
        }
    EXPECT_FALSE(std::filesystem::exists(file("never.dimmer")));
}

// A flipped bit may leave a level that is merely another one: then it cooks. Anything else is refused.
TEST_F(DamagedFiles, FlippedBitsInLevels) {
    const auto bytes = cook::test::twoCells().glb();
    Random random(5);
    int refused = 0;
    for (int i = 0; i < 30; ++i) {
        std::string damaged(bytes.begin(), bytes.end());
        const size_t byte = random() % damaged.size();
        damaged[byte] = static_cast<char>(damaged[byte] ^ 1 << pick(random, 0, 7));
        write("flipped.glb", damaged);
        std::filesystem::remove(file("flipped.dimmer"));
        const auto result = cook("flipped.dimmer", {}, "flipped.glb");
        EXPECT_EQ(std::filesystem::exists(file("flipped.dimmer")), result.exit_code == 0);
        if (result.exit_code == 0) continue;
        ++refused;
        // Flipped coordinates may also be far apart and so too large for the profile's budget.
        EXPECT_TRUE(result.exit_code == 2 || result.exit_code == 3) << "byte " << byte << "\n" << result.err;
        EXPECT_THAT(result.err, HasSubstr("dimmer: error: "));
    }
    EXPECT_GT(refused, 3);
}

}  // namespace
}  // namespace dimmer::test
