// The tables of a pack as its file has them: counts and names only. Where everything starts, which record is whose and
// what borders on what follows from those, so it is neither stored nor can it be wrong.
#pragma once

#include <pack/pack_data.h>

#include <cstdint>
#include <span>
#include <vector>

namespace dimmer {

struct StoredCluster {
    uint32_t receiver_count = 0, batch_count = 0, term_count = 0;
};
static_assert(sizeof(StoredCluster) == 12);

// Of texels, or of probes.
struct StoredTables {
    std::vector<StoredCluster> clusters;
    std::vector<uint32_t> terms;    // the contribution of each
    std::vector<uint32_t> batches;  // the receivers of each
};

struct ReceiverTables {
    std::vector<Cluster> clusters;
    std::vector<ClusterTerm> terms;
    std::vector<Batch> batches;
};

StoredTables storedTables(const ReceiverView& tables);

// Linear in the tables, whatever they say; what makes no sense is for validate() to refuse. `record_counts`: per
// contribution, what its payload holds.
ReceiverTables restored(const StoredTables& stored, std::span<const uint32_t> record_counts);

// Fills in each tetrahedron's neighbours: those that share a face. False where one names a probe past `probe_count`,
// or three share a face. Time: linear, and n log n in the tetrahedra around one probe.
bool joinFaces(std::span<Tetrahedron> tetrahedra, size_t probe_count);

}  // namespace dimmer
