// Numbers of bytes for people.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

namespace dimmer::cook {

// "999 B", "1.0 kB" (1000 of them), "2.50 MB" (1,000,000).
inline std::string humanBytes(uint64_t bytes) {
    if (bytes < 1000) return fmt::format("{} B", bytes);
    if (bytes < 1000000) return fmt::format("{:.1f} kB", static_cast<double>(bytes) / 1e3);
    return fmt::format("{:.2f} MB", static_cast<double>(bytes) / 1e6);
}

}  // namespace dimmer::cook
