// The readers of what comes from outside, each as a function of bytes: for the fuzzer (fuzz_main.cpp, scripts/fuzz) and
// for a short run in the tests (fuzz_test.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace dimmer::fuzz {

using Input = std::span<const uint8_t>;
using Bytes = std::vector<uint8_t>;

struct Target {
    std::string_view name;
    // Reads the bytes, uses what came out, and aborts when a promise is broken.
    void (*run)(Input input);
    // Small inputs that reach every part of the reader.
    std::vector<Bytes> (*seeds)();
    // Memory that an input of n bytes may hold at most: fixed + n * per_byte. The factor is the reader's own
    // structures: a JSON value or a glTF node of a few characters is some hundred bytes of C++ objects.
    size_t memory_fixed_bytes, memory_per_byte;
};

std::span<const Target> targets();
// Null for an unknown name.
const Target* findTarget(std::string_view name);

// Prints `promise` and aborts when it does not hold; unlike assert, in every build.
void require(bool holds, const char* promise);

// Runs the target and checks its use of memory, where the build can tell (address sanitizer).
void runChecked(const Target& target, Input input);

inline std::string_view textOf(Input input) {
    return {reinterpret_cast<const char*>(input.data()), input.size()};
}
inline Bytes bytesOf(std::string_view text) {
    return {text.begin(), text.end()};
}

// One per file of this folder.
void runPack(Input input);
std::vector<Bytes> packSeeds();
void runGltf(Input input);
std::vector<Bytes> gltfSeeds();
void runProfile(Input input);
std::vector<Bytes> profileSeeds();
void runState(Input input);
std::vector<Bytes> stateSeeds();
void runScript(Input input);
std::vector<Bytes> scriptSeeds();
void runIes(Input input);
std::vector<Bytes> iesSeeds();

}  // namespace dimmer::fuzz
