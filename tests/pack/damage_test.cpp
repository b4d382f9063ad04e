// Packs that are damaged on the way: every one an error that says where, never a crash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/pack_file.h>
#include <pack/sample_pack.h>
#include <sys/resource.h>
#include <write/pack_writer.h>
#include <xxhash.h>
#include <zstd.h>

#include <cstring>
#include <fstream>
#include <functional>

namespace dimmer::test {
namespace {

using cook::packBytes;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

using Bytes = std::vector<std::byte>;

void expectRefused(const Bytes& bytes, const std::string& fragment, const std::string& context = "") {
    const auto pack = Pack::fromBytes(bytes, "level.dimmer");
    ASSERT_FALSE(pack.has_value()) << context << ": accepted";
    EXPECT_EQ(pack.error().code, ErrorCode::BadInput) << context;
    EXPECT_THAT(pack.error().message, AllOf(StartsWith("level.dimmer: "), HasSubstr(fragment))) << context;
}

void expectRefused(const PackFile& file, const std::string& fragment) {
    expectRefused(file.bytes(), fragment);
}

TEST(PackDamage, TruncatedAnywhere) {
    const Bytes whole = packBytes(samplePack());
    std::vector<size_t> lengths;
    for (size_t n = 0; n < 200; ++n) lengths.push_back(n);
    for (size_t n = 200; n < whole.size(); n += whole.size() / 300) lengths.push_back(n);
    lengths.push_back(whole.size() - 1);
    for (const size_t n : lengths)
        expectRefused(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)),
                      fmt::format("the file has {} bytes", n));
    Bytes longer = whole;
    longer.push_back({});
    expectRefused(longer, fmt::format("the file has {} bytes", longer.size()));
}

// The name of the chunk that owns a byte; empty for padding, which nobody reads.
std::string ownerOf(const Bytes& file, size_t byte) {
    format::Header header;
    std::memcpy(&header, file.data(), sizeof(header));
    for (uint32_t i = 0; i < header.chunk_count; ++i) {
        format::Chunk c;
        std::memcpy(&c, file.data() + sizeof(header) + i * sizeof(c), sizeof(c));
        if (byte < c.offset || byte >= c.offset + c.stored_bytes) continue;
        return typeName(c.type) + (c.type == format::fourcc("PAYL") ? fmt::format(" {}", c.subject) : "");
    }
    return {};
}

TEST(PackDamage, AnyBitOfTheHeaderAndTheTable) {
    const Bytes whole = packBytes(samplePack());
    const size_t end = sizeof(format::Header) + 48 * size_t{10 + samplePack().contributions.size()};
    for (size_t bit = 0; bit < 8 * end; ++bit) {
        Bytes damaged = whole;
        damaged[bit / 8] ^= std::byte{1} << (bit % 8);
        const size_t byte = bit / 8;
        const std::string reason = byte < 8                  ? "not a Dimmer pack"
                                   : byte < 12               ? "version"
                                   : byte < 16               ? "byte order"
                                   : byte < 24               ? "its header says"
                                   : byte >= 48 && byte < 52 ? ""  // the chunk count: its table may not even fit
                                                             : "the header or the chunk table is damaged";
        expectRefused(damaged, reason, fmt::format("bit {}", bit));
    }
}

TEST(PackDamage, FlippedBitsInEveryChunkAreNamed) {
    const Bytes whole = packBytes(samplePack());
    Random random(3);
    std::map<std::string, int> hits;
    while (hits.size() < 10 + samplePack().contributions.size()) {
        const size_t byte = pick(random, 0, static_cast<uint32_t>(whole.size()) - 1);
        const std::string owner = ownerOf(whole, byte);
        if (owner.empty() || hits[owner]++ > 20) continue;
        Bytes damaged = whole;
        damaged[byte] ^= std::byte{1} << pick(random, 0, 7);
        expectRefused(damaged, "chunk " + owner + " is damaged", fmt::format("byte {}", byte));
    }
}

// Found by fuzzing: nothing to unshuffle took as many steps as a record claimed to have bytes, 4 billion for each
// chunk.
TEST(PackDamage, AnEmptyChunkOfHugeRecordsIsReadAtOnce) {
    PackData data = samplePack();
    data.meshes.clear();
    data.viewpoints.clear();
    // Without receivers: empty payloads.
    for (int i = 0; i < 200; ++i) data.contributions.push_back({});
    PackFile file(packBytes(data));
    size_t empty = 0;
    for (ChunkContent& c : file.chunks) {
        if (!c.bytes.empty()) continue;
        c.shuffle = UINT32_MAX;
        ++empty;
    }
    EXPECT_GE(empty, 200u);
    const auto pack = Pack::fromBytes(file.bytes(), "level.dimmer");
    EXPECT_TRUE(pack.has_value()) << pack.error().message;  // 800 billion steps would be minutes
}

TEST(PackDamage, FlagsOfTheFuture) {
    PackFile file(packBytes(samplePack()));
    file.chunk("MESH").flags = 4;
    expectRefused(file.bytes(), "chunk MESH is stored in a way that this build does not know");
}

TEST(PackDamage, ForeignFiles) {
    const Bytes whole = packBytes(samplePack());
    Bytes other = whole;
    std::memcpy(other.data(), "glTF\2\0\0\0", 8);
    expectRefused(other, "not a Dimmer pack");
    other = whole;
    const uint32_t future = format::version + 1;
    std::memcpy(other.data() + 8, &future, 4);
    expectRefused(other, fmt::format("of format version {}", future));
    other = whole;
    std::reverse(other.begin() + 12, other.begin() + 16);
    expectRefused(other, "byte order");
    expectRefused(Bytes(), "0 bytes");
    expectRefused(Bytes(4096), "not a Dimmer pack");
    for (const auto& path : {std::filesystem::temp_directory_path(), std::filesystem::path("no/such.dimmer")}) {
        const auto pack = Pack::open(path);
        ASSERT_FALSE(pack.has_value());
        EXPECT_EQ(pack.error().code, ErrorCode::Io);
        EXPECT_THAT(pack.error().message, StartsWith(path.string()));
    }
}

TEST(PackDamage, EveryChunkIsNeededOnce) {
    const PackFile whole(packBytes(samplePack()));
    for (size_t i = 0; i < whole.chunks.size(); ++i) {
        PackFile missing = whole;
        missing.chunks.erase(missing.chunks.begin() + static_cast<std::ptrdiff_t>(i));
        expectRefused(missing, "chunk " + typeName(whole.chunks[i].type));
        PackFile twice = whole;
        twice.chunks.push_back(whole.chunks[i]);
        expectRefused(twice, "twice");
    }
    PackFile extra = whole;
    extra.chunks.push_back(extra.chunk("PAYL", 0));
    extra.chunks.back().subject = 1000;
    expectRefused(extra, "chunk PAYL 1000 belongs to nothing");
}

// All pairs of chunks with their contents swapped: what a table says is not what stands there.
TEST(PackDamage, SwappedChunks) {
    const PackFile whole(packBytes(samplePack()));
    int swapped = 0;
    for (size_t i = 0; i < whole.chunks.size(); ++i)
        for (size_t j = i + 1; j < whole.chunks.size(); ++j) {
            PackFile file = whole;
            if (file.chunks[i].bytes.size() == file.chunks[j].bytes.size()) continue;
            std::swap(file.chunks[i].bytes, file.chunks[j].bytes);
            const auto pack = Pack::fromBytes(file.bytes(), "test");
            ASSERT_FALSE(pack.has_value()) << typeName(file.chunks[i].type) << " " << typeName(file.chunks[j].type);
            EXPECT_EQ(pack.error().code, ErrorCode::BadInput);
            ++swapped;
        }
    EXPECT_GT(swapped, 100);
}

// The same file with another table, which is right about its own hash.
Bytes withTable(Bytes file, const std::function<void(std::vector<format::Chunk>&)>& change) {
    format::Header header;
    std::memcpy(&header, file.data(), sizeof(header));
    std::vector<format::Chunk> table(header.chunk_count);
    const size_t table_bytes = table.size() * sizeof(table[0]);
    std::memcpy(table.data(), file.data() + sizeof(header), table_bytes);
    change(table);
    std::memcpy(file.data() + sizeof(header), table.data(), table_bytes);
    header.xxh64 = 0;
    std::memcpy(file.data(), &header, sizeof(header));
    header.xxh64 = XXH64(file.data(), sizeof(header) + table_bytes, 0);
    std::memcpy(file.data(), &header, sizeof(header));
    return file;
}

TEST(PackDamage, ChunksOutOfPlace) {
    const Bytes whole = packBytes(samplePack());
    const std::vector<std::pair<std::function<void(format::Chunk&)>, std::string>> faults = {
        {[](format::Chunk& c) { c.offset = 0; }, "misplaced"},
        {[](format::Chunk& c) { c.offset += 1; }, "misplaced"},
        {[](format::Chunk& c) { c.offset = UINT64_MAX - 63; }, "past the end"},
        {[&](format::Chunk& c) { c.offset = (whole.size() + 127) / 64 * 64; }, "past the end"},
        {[](format::Chunk& c) { c.stored_bytes = UINT64_MAX; }, "past the end"},
        {[&](format::Chunk& c) { c.stored_bytes = whole.size(); }, "past the end"},
        {[](format::Chunk& c) { c.real_bytes = UINT64_MAX; }, "impossible size"},
        // 2 pages of 32 x 32.
        {[](format::Chunk& c) { c.real_bytes += 8; }, "states 16392 bytes instead of 16384"},
        {[](format::Chunk& c) { c.real_bytes += 1; }, "chunk BASE ends within a record"},
        {[](format::Chunk& c) { c.shuffle = 7; }, "chunk BASE ends within a record"},
        {[](format::Chunk& c) { c.shuffle = 0; }, "impossible size"},
        {[](format::Chunk& c) { c.xxh64 ^= 1; }, "is damaged"},
    };
    for (size_t i = 0; i < faults.size(); ++i) {
        const Bytes file = withTable(whole, [&](auto& table) { faults[i].first(table[2]); });  // BASE
        expectRefused(file, "chunk BASE", fmt::format("fault {}", i));
        expectRefused(file, faults[i].second, fmt::format("fault {}", i));
    }
}

TEST(PackDamage, AChunkHoldsWhatItStates) {
    const Bytes file = withTable(packBytes(samplePack()), [](auto& table) { table[1].real_bytes += 1; });
    expectRefused(file, "does not hold the", "one byte more");
}

// Of one frame under many names, 31 kB unfolded to hundreds of megabytes.
TEST(PackDamage, ChunksThatShareBytes) {
    const Bytes whole = packBytes(samplePack());
    // The entry `thief` of the table names what `owner` has, or that from its second 64 bytes on.
    const auto shared = [&](size_t thief, size_t owner, uint64_t skipped) {
        return withTable(whole, [&](auto& table) {
            table[thief].offset = table[owner].offset + skipped;
            table[thief].stored_bytes = table[owner].stored_bytes - skipped;
            table[thief].real_bytes = table[owner].real_bytes;
            table[thief].xxh64 = table[owner].xxh64;
        });
    };
    expectRefused(shared(0, 2, 0), "chunk ELEM and chunk BASE share bytes");
    expectRefused(shared(0, 2, 64), "chunk BASE and chunk ELEM share bytes");
    expectRefused(shared(8, 7, 0), "chunk PAYL 0 and chunk PAYL 1 share bytes");
}

TEST(PackDamage, TooManyChunksForTheFile) {
    PackFile file(packBytes(samplePack()));
    for (const uint32_t count : {1000u, 0x7fffffffu, 0xffffffffu}) {
        Bytes bytes = file.bytes();
        std::memcpy(bytes.data() + 48, &count, 4);
        expectRefused(bytes, "");
    }
    file.chunks.clear();
    expectRefused(file, "chunk ELEM is missing");
}

uint64_t peakBytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

// A frame that promises 1 GiB and holds rubbish: refused before anything of that size is allocated.
TEST(PackDamage, AFrameThatOnlyClaimsToBeLarge) {
    constexpr uint64_t claimed = 1 << 30;
    PackFile file(packBytes(samplePack()));
    ChunkContent& settings = file.chunk("SETT");
    // RFC 8878, 3.1.1: magic, a header with an 8-byte content size and one segment, then no valid block.
    settings.stored.resize(64 * 1024, std::byte{0xff});
    const uint32_t magic = 0xFD2FB528;
    std::memcpy(settings.stored.data(), &magic, 4);
    settings.stored[4] = std::byte{0b11000000};
    settings.stored[5] = std::byte{0x50};  // a window of 1 MiB
    std::memcpy(settings.stored.data() + 6, &claimed, 8);
    settings.claimed_bytes = claimed;
    ASSERT_EQ(ZSTD_getFrameContentSize(settings.stored.data(), settings.stored.size()), claimed);
    const uint64_t peak_before = peakBytes();
    expectRefused(file, "chunk SETT");
    // The same with a window of 1 GiB, which the decoder would have to reserve.
    settings.stored[5] = std::byte{0xa0};
    expectRefused(file, "chunk SETT");
    // A quarter of the claim is far above what 64 KiB of input and the test itself need.
    EXPECT_LT(peakBytes() - peak_before, claimed / 4);
}

TEST(PackDamage, FramesThatDoNotFit) {
    const PackFile whole(packBytes(samplePack()));
    for (const auto& c : whole.chunks) {
        Bytes frame(ZSTD_compressBound(c.bytes.size()));
        frame.resize(ZSTD_compress(frame.data(), frame.size(), c.bytes.data(), c.bytes.size(), 1));
        auto with = [&](const Bytes& stored) {
            PackFile file = whole;
            file.chunks[static_cast<size_t>(&c - whole.chunks.data())].stored = stored;
            return file;
        };
        expectRefused(with(Bytes(frame.begin(), frame.end() - 1)), "chunk " + typeName(c.type));
        Bytes followed = frame;
        followed.push_back({});
        expectRefused(with(followed), "chunk " + typeName(c.type));
        Bytes doubled = frame;
        doubled.insert(doubled.end(), frame.begin(), frame.end());
        expectRefused(with(doubled), "chunk " + typeName(c.type));
        expectRefused(with({std::byte{0}}), "chunk " + typeName(c.type));
    }
}

}  // namespace
}  // namespace dimmer::test
