// A reciprocal that is the same on every device. GLSL twin: dimmer_reciprocal (shaders/include/dimmer/texel.glsl).
#pragma once

#include <bit>
#include <cstdint>

namespace dimmer {

// 1 / x to 1e-7 of it, and of powers of two exactly; of what is 1e-37 to 1e37 away from 0. Vulkan has floats multiplied
// and subtracted with correct rounding, but divided to 2.5 ULP, by each device in its own way: pages and probes that
// the CPU and GPUs of all kinds agree on to the bit must not divide. From a guess by the bits, 5 % off at most,
// Newton's step thrice: each squares what it is off by.
inline float reciprocal(float x) {
    float y = std::bit_cast<float>(0x7ef311c3u - std::bit_cast<uint32_t>(x));
    for (int step = 0; step < 2; ++step) y = y * (2.0f - x * y);
    return y + y * (1.0f - x * y);
}

}  // namespace dimmer
