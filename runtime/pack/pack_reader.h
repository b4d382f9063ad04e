// Reads the bytes of a pack into PackData. Trusts nothing: every size is checked against the file before it is used.
#pragma once

#include <pack/pack_data.h>

#include <cstddef>
#include <span>

namespace dimmer {

// The chunks and tables are checked here, what they mean by validate(). Allocates no more than `bytes` can justify:
// a chunk's real size is bounded by what its compressed frame can decode to.
Expected<PackData> readPack(std::span<const std::byte> bytes);

}  // namespace dimmer
