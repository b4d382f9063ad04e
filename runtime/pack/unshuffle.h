// A chunk's bytes back in the order of its records.
#pragma once

#include <cstddef>
#include <span>

namespace dimmer {

// `shuffled` holds the first bytes of all records, then all second ones, and so on: as they are, or each as what it is
// more than the one before it in its group (`differences`; the first as it is). Writes whole records of `record_bytes`
// to `out`, which has as many bytes and does not overlap. Cost: each byte is read and written once.
void unshuffle(std::span<const std::byte> shuffled, size_t record_bytes, bool differences, std::span<std::byte> out);

}  // namespace dimmer
