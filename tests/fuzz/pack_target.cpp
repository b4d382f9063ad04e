// Packs. Sizes and hashes are put right before reading, or nothing but the hash check would ever be reached.
#include <dimmer/cpu_runtime.h>
#include <format/layout.h>
#include <fuzz/target.h>
#include <pack/pack_file.h>
#include <pack/sample_pack.h>
#include <pipeline/budget.h>
#include <write/pack_writer.h>
#include <xxhash.h>

#include <cmath>
#include <cstring>

namespace dimmer::fuzz {
namespace {

using format::Chunk;
using format::Header;

// The table's chunks that lie inside the file.
std::vector<Chunk> chunksOf(const Bytes& file) {
    Header header;
    std::memcpy(&header, file.data(), sizeof(header));
    const size_t count = std::min<size_t>(header.chunk_count, (file.size() - sizeof(Header)) / sizeof(Chunk));
    std::vector<Chunk> chunks(count);
    if (count > 0) std::memcpy(chunks.data(), file.data() + sizeof(Header), count * sizeof(Chunk));
    return chunks;
}

void mend(Bytes& file) {
    std::vector<Chunk> chunks = chunksOf(file);
    Header header;
    std::memcpy(&header, file.data(), sizeof(header));
    header.magic = format::magic;
    header.version = format::version;
    header.endian_tag = format::endian_tag;
    header.file_bytes = file.size();
    header.chunk_count = static_cast<uint32_t>(chunks.size());
    for (Chunk& c : chunks)
        if (c.offset <= file.size() && c.stored_bytes <= file.size() - c.offset)
            c.xxh64 = XXH64(file.data() + c.offset, c.stored_bytes, 0);
    header.xxh64 = 0;
    std::memcpy(file.data(), &header, sizeof(header));
    if (!chunks.empty()) std::memcpy(file.data() + sizeof(header), chunks.data(), chunks.size() * sizeof(Chunk));
    header.xxh64 = XXH64(file.data(), sizeof(header) + chunks.size() * sizeof(Chunk), 0);
    std::memcpy(file.data(), &header, sizeof(header));
}

// An empty page unfolds 43690-fold, rightly so. Large ones would only slow the fuzzer down.
constexpr uint64_t unfolded_max = 4 << 20;

bool unfoldsTooFar(const Bytes& file) {
    uint64_t sum = 0;
    for (const Chunk& c : chunksOf(file)) {
        if (c.real_bytes > unfolded_max) return true;
        sum += c.real_bytes;
    }
    return sum > unfolded_max;
}

void use(const Pack& pack) {
    CpuRuntime runtime(pack);
    runtime.update();
    for (const Element& e : pack.elements()) {
        if (e.kind == ElementKind::Door)
            require(runtime.setDoor(*runtime.door(e.name), 0.5f).has_value(), "a door of the pack can be set");
        else
            require(runtime.setWeight(*runtime.lightSet(e.name), e.max_weight).has_value(), "a set takes its maximum");
    }
    runtime.update();
    const auto lux = sampleLightmap(pack, runtime.irradiancePages(), runtime.directionPages(), pack.pageCount() - 1,
                                    {0.5f, 0.25f}, {0, 0, 1});
    for (const float channel : lux) require(!std::isnan(channel) && channel >= 0, "light is never NaN nor negative");
    require(cook::costOf(pack.data()).elements.size() == pack.elements().size(), "every element has a cost");
}

// A zstd frame with its bytes as they are (RFC 8878, raw blocks), so that mutations reach what is inside.
Bytes rawFrame(Input bytes) {
    Bytes frame = {0x28, 0xb5, 0x2f, 0xfd, 0xe0};  // a single segment, its size in 8 bytes
    for (int i = 0; i < 8; ++i) frame.push_back(static_cast<uint8_t>(uint64_t{bytes.size()} >> (8 * i)));
    constexpr size_t block_max = 128 * 1024;
    do {
        const size_t size = std::min(bytes.size(), block_max);
        const bool last = size == bytes.size();
        const auto header = static_cast<uint32_t>(size << 3 | (last ? 1 : 0));
        for (int i = 0; i < 3; ++i) frame.push_back(static_cast<uint8_t>(header >> (8 * i)));
        frame.insert(frame.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        bytes = bytes.subspan(size);
    } while (!bytes.empty());
    return frame;
}

// The same pack with its chunks uncompressed and unshuffled.
Bytes withRawChunks(const PackData& data) {
    const auto packed = cook::packBytes(data);
    const auto* first = reinterpret_cast<const uint8_t*>(packed.data());
    test::PackFile file(packed);
    for (test::ChunkContent& c : file.chunks) {
        c.shuffle = 1;
        const Bytes frame = rawFrame({reinterpret_cast<const uint8_t*>(c.bytes.data()), c.bytes.size()});
        const auto bytes = std::as_bytes(std::span(frame));
        c.stored.assign(bytes.begin(), bytes.end());
    }
    const auto bytes = file.bytes();
    first = reinterpret_cast<const uint8_t*>(bytes.data());
    return {first, first + bytes.size()};
}

PackData smallPack() {
    PackData data =
        test::randomPack(7, {.sets = 2, .doors = 1, .clusters = 3, .overlap_max = 3, .page_count = 1, .page_side = 16});
    return data;
}

}  // namespace

void runPack(Input input) {
    if (input.size() < sizeof(Header)) return;
    Bytes file(input.begin(), input.end());
    mend(file);
    if (unfoldsTooFar(file)) return;
    const auto pack = Pack::fromBytes(std::as_bytes(std::span(file)), "fuzz.dimmer");
    if (pack)
        use(*pack);
    else
        require(pack.error().message.starts_with("fuzz.dimmer: "), "an error names the file");
}

std::vector<Bytes> packSeeds() {
    PackData small = smallPack();
    PackData probes = smallPack();
    test::Random random(3);
    test::addRandomProbes(probes, random, 2);
    PackData whole = smallPack();
    whole.meshes = test::samplePack().meshes;
    whole.meshes[1].page = 0;
    whole.meshes[1].door = 2;
    whole.meshes[1].emission_set = 1;
    whole.viewpoints = test::samplePack().viewpoints;
    whole.settings_json = R"({"quality": {"value": "draft", "from": "command line"}})";
    whole.color_format = ColorFormat::E5B9G9R9;
    const auto compressed = cook::packBytes(whole);
    const auto* first = reinterpret_cast<const uint8_t*>(compressed.data());
    return {withRawChunks(small), withRawChunks(probes), withRawChunks(whole), {first, first + compressed.size()}};
}

}  // namespace dimmer::fuzz
