// Work without a clock: what is copied or decoded in vain has to be allocated first.
#pragma once

#include <cstddef>
#include <optional>

namespace dimmer::test {

// Bytes that this thread has asked operator new for since it started; nothing in builds whose sanitizer has an
// allocator of its own.
std::optional<size_t> allocatedBytes();

}  // namespace dimmer::test
