// The fuzzer's program: writes the seeds, and runs files to repeat what was found; with DIMMER_FUZZ (scripts/fuzz) it
// is libFuzzer, which makes inputs of its own.
#include <fuzz/target.h>

#include <unistd.h>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#ifdef DIMMER_LIBFUZZER
extern "C" int LLVMFuzzerRunDriver(int* argc, char*** argv, int (*run)(const uint8_t* data, size_t size));

// libFuzzer counts by clang's instrumentation, or by what it finds in this section. g++ calls a function in each basic
// block: its place is hashed into 2^17 counters, of which the readers' some ten thousand blocks share few. (libFuzzer's
// own function of that name does nothing but refuse; the linker puts this one in its place.)
constexpr int counter_bits = 17;
__attribute__((section("__libfuzzer_extra_counters"))) static uint8_t counters[1 << counter_bits];

extern "C" __attribute__((no_sanitize_coverage, no_sanitize("address", "undefined"))) void
__wrap___sanitizer_cov_trace_pc() {
    const uint64_t place =
        reinterpret_cast<uintptr_t>(__builtin_return_address(0)) - reinterpret_cast<uintptr_t>(&counters);
    ++counters[(place * 0x9e3779b97f4a7c15u) >> (64 - counter_bits)];
}

// Comparisons of floats, which libFuzzer does not learn from.
extern "C" void __sanitizer_cov_trace_cmpf(float, float) {}
extern "C" void __sanitizer_cov_trace_cmpd(double, double) {}
#endif

namespace {

using namespace dimmer::fuzz;

int usage() {
    std::fprintf(stderr,
                 "usage: dimmer_fuzz --seeds DIR    write the seeds of every target, a folder each\n"
                 "       dimmer_fuzz TARGET FILE... run these inputs; under libFuzzer: its options and folders\n"
                 "targets:");
    for (const Target& target : targets())
        std::fprintf(stderr, " %.*s", static_cast<int>(target.name.size()), target.name.data());
    std::fprintf(stderr, "\n");
    return 2;
}

int writeSeeds(const std::filesystem::path& root) {
    for (const Target& target : targets()) {
        const auto folder = root / target.name;
        std::filesystem::create_directories(folder);
        for (int number = 0; const Bytes& seed : target.seeds()) {
            std::ofstream file(folder / ("seed_" + std::to_string(number++)), std::ios::binary);
            file.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
            if (!file) return 1;
        }
    }
    return 0;
}

[[maybe_unused]] int runFile(const Target& target, const char* path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        std::fprintf(stderr, "%s cannot be opened\n", path);
        return 1;
    }
    const Bytes input{std::istreambuf_iterator<char>(file), {}};
    runChecked(target, input);
    return 0;
}

#ifdef DIMMER_LIBFUZZER
const Target* fuzzed = nullptr;

int runOne(const uint8_t* data, size_t size) {
    runChecked(*fuzzed, {data, size});
    return 0;
}
#endif

}  // namespace

int main(int argc, char** argv) {
    if (argc == 3 && std::strcmp(argv[1], "--seeds") == 0) return writeSeeds(argv[2]);
    const Target* target = argc > 1 ? findTarget(argv[1]) : nullptr;
    if (!target) return usage();
#ifdef DIMMER_LIBFUZZER
    fuzzed = target;
    target->run({});  // what is made once is made before memory is counted
    argv[1] = argv[0];
    --argc;
    ++argv;
    return LLVMFuzzerRunDriver(&argc, &argv, runOne);
#else
    if (argc == 2) return usage();
    for (int i = 2; i < argc; ++i)
        if (const int failed = runFile(*target, argv[i])) return failed;
    return 0;
#endif
}
