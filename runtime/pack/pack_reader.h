// Reads the bytes of a pack into PackData. Trusts nothing: every size is checked against the file before it is used.
#pragma once

#include <pack/pack_data.h>
#include <pack/pack_source.h>

namespace dimmer {

// The chunks and tables are checked here, what they mean by validate(). Allocates no more than the source can justify:
// a chunk's real size is bounded by what its compressed frame can decode to. Beside what it returns there is one chunk
// in memory at a time, as it is stored and as it decodes.
Expected<PackData> readPack(PackSource& source);

}  // namespace dimmer
