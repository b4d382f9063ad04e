#include <scene/allocated_bytes.h>

#include <cstdlib>
#include <new>

namespace dimmer::test {
namespace {

[[maybe_unused]] thread_local size_t allocated_bytes = 0;

}  // namespace

#ifdef __SANITIZE_ADDRESS__

std::optional<size_t> allocatedBytes() {
    return std::nullopt;
}

}  // namespace dimmer::test

#else

std::optional<size_t> allocatedBytes() {
    return allocated_bytes;
}

}  // namespace dimmer::test

// Every other operator new but the aligned ones ends in this one, and every delete in this one's. Inlined they would
// look like a mismatch to the compiler.
__attribute__((noinline)) void* operator new(size_t bytes) {
    dimmer::test::allocated_bytes += bytes;
    if (void* memory = std::malloc(bytes == 0 ? 1 : bytes)) return memory;
    throw std::bad_alloc();
}

__attribute__((noinline)) void operator delete(void* memory) noexcept {
    std::free(memory);
}
__attribute__((noinline)) void operator delete(void* memory, size_t) noexcept {
    std::free(memory);
}

#endif
