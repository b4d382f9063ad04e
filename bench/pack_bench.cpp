// How fast a pack's chunks are decompressed, and how much smaller they are. DIMMER_BENCH_PACK names a pack.
#include <format/layout.h>
#include <pack/decompress.h>
#include <pack/pack_reader.h>

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <vector>

namespace dimmer {
namespace {

std::vector<std::byte> packFile() {
    const char* name = std::getenv("DIMMER_BENCH_PACK");
    std::ifstream file(name ? name : "house.dimmer", std::ios::binary | std::ios::ate);
    if (!file) std::abort();
    std::vector<std::byte> bytes(static_cast<size_t>(file.tellg()));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return bytes;
}

std::vector<format::Chunk> chunksOf(const std::vector<std::byte>& file) {
    format::Header header;
    std::memcpy(&header, file.data(), sizeof(header));
    std::vector<format::Chunk> chunks(header.chunk_count);
    std::memcpy(chunks.data(), file.data() + sizeof(header), chunks.size() * sizeof(format::Chunk));
    return chunks;
}

// What blends are made of: texels and probes, at weight 0 and of contributions.
bool isRecords(const format::Chunk& c) {
    using enum format::ChunkType;
    const auto type = static_cast<format::ChunkType>(c.type);
    return type == BasePages || type == Payload || type == ProbeBase || type == ProbePayload;
}

void setCounters(benchmark::State& state, const std::vector<std::byte>& file) {
    double real = 0, stored = 0, raw_records = 0, records = 0;
    for (const format::Chunk& c : chunksOf(file)) {
        real += static_cast<double>(c.real_bytes);
        stored += static_cast<double>(c.stored_bytes);
        raw_records += isRecords(c) ? static_cast<double>(c.real_bytes) : 0;
        records += isRecords(c) ? static_cast<double>(c.stored_bytes) : 0;
    }
    state.counters["file/raw records"] = static_cast<double>(file.size()) / raw_records;
    state.counters["records/raw records"] = records / raw_records;
    state.SetBytesProcessed(static_cast<int64_t>(real) * static_cast<int64_t>(state.iterations()));
    state.counters["stored/real"] = stored / real;
}

// zstd alone, on one core.
void decompressChunks(benchmark::State& state) {
    const auto file = packFile();
    const auto chunks = chunksOf(file);
    for (auto _ : state) {
        Decompressor decompressor;
        for (const format::Chunk& c : chunks)
            benchmark::DoNotOptimize(decompressor.run(std::span(file).subspan(c.offset, c.stored_bytes), c.real_bytes));
    }
    setCounters(state, file);
}
BENCHMARK(decompressChunks)->Unit(benchmark::kMillisecond);

// The whole of Pack::open but for the file system: hashes, zstd, byte order of the records, validation.
void readWholePack(benchmark::State& state) {
    const auto file = packFile();
    for (auto _ : state) {
        MemorySource source(file);
        benchmark::DoNotOptimize(readPack(source));
    }
    setCounters(state, file);
}
BENCHMARK(readWholePack)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dimmer

BENCHMARK_MAIN();
