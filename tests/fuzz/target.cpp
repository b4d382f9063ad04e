#include <fuzz/target.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>

#ifdef __SANITIZE_ADDRESS__
// g++ ships the sanitizer's library without this part of its headers.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*allocated)(const volatile void*, size_t),
                                                         void (*released)(const volatile void*));
extern "C" size_t __sanitizer_get_allocated_size(const volatile void* pointer);
#endif

namespace dimmer::fuzz {
namespace {

// Memory held by the process, as the sanitizer's hooks count it.
std::atomic<int64_t> held_bytes = 0, peak_bytes = 0;

#ifdef __SANITIZE_ADDRESS__
void countAllocation(const volatile void*, size_t size) {
    const int64_t held = held_bytes += static_cast<int64_t>(size);
    int64_t peak = peak_bytes;
    while (held > peak && !peak_bytes.compare_exchange_weak(peak, held)) {
    }
}

void countRelease(const volatile void* pointer) {
    if (pointer) held_bytes -= static_cast<int64_t>(__sanitizer_get_allocated_size(pointer));
}

const bool hooked = __sanitizer_install_malloc_and_free_hooks(countAllocation, countRelease) != 0;
#endif

constexpr size_t megabyte = 1 << 20;

constexpr std::array list = {
    // 16 MiB: what runPack lets chunks unfold to, four times over.
    Target{"pack", runPack, packSeeds, 17 * megabyte, 1000},
    // Decoded textures take 4 bytes a texel, and a kilobyte of PNG holds a million texels.
    Target{"gltf", runGltf, gltfSeeds, 64 * megabyte, 4000},
    Target{"profile", runProfile, profileSeeds, megabyte, 1000},
    Target{"state", runState, stateSeeds, megabyte, 1000},
    Target{"script", runScript, scriptSeeds, megabyte, 1000},
    // 16 MiB of texels are the most that runHdr asks for.
    Target{"hdr", runHdr, hdrSeeds, 20 * megabyte, 1000},
    Target{"ies", runIes, iesSeeds, megabyte, 1000},
};

}  // namespace

std::span<const Target> targets() {
    return list;
}

const Target* findTarget(std::string_view name) {
    const auto found = std::ranges::find(list, name, &Target::name);
    return found == list.end() ? nullptr : &*found;
}

void require(bool holds, const char* promise) {
    if (holds) return;
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
}

void runChecked(const Target& target, Input input) {
    const int64_t before = held_bytes;
    peak_bytes = before;
    target.run(input);
    const auto allowed = static_cast<int64_t>(target.memory_fixed_bytes + input.size() * target.memory_per_byte);
    if (peak_bytes - before > allowed)
        std::fprintf(stderr, "%zu bytes of input took %lld bytes of memory\n", input.size(),
                     static_cast<long long>(peak_bytes - before));
    require(peak_bytes - before <= allowed, "memory grows with the input alone");
}

}  // namespace dimmer::fuzz
