// The tables of a pack as its file has them: counts and names only. Where everything starts, which record is whose and
// what borders on what follows from those, so it is neither stored nor can it be wrong.
#pragma once

#include <pack/pack_data.h>

#include <cstdint>
#include <optional>
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

// A tetrahedron told by an earlier one that shares a face with it: the one `from / 4` before it, with another probe at
// corner `from % 4`. Where there is none, `from` is 0 and this is a corner; four in a row are a tetrahedron.
// `probe` counts down from one more than the highest number so far (modulo 2^32), so that one that comes up for the
// first time is mostly 0. The last grid_box_corners numbers, which come up anywhere, do not count as high.
struct StoredTetrahedron {
    uint32_t from = 0, probe = 0;
};
static_assert(sizeof(StoredTetrahedron) == 8);

// Of any tetrahedra; small where a grid is numbered face by face. Neighbours must be known. Linear.
std::vector<StoredTetrahedron> storedTetrahedra(std::span<const Tetrahedron> tetrahedra, size_t probe_count);

// The same tetrahedra in the same order, corners too, with neighbours. Empty where records are those of no tetrahedra,
// one names a probe past `probe_count`, or three share a face. Cost as of joinFaces(); allocates as the records do.
std::optional<std::vector<Tetrahedron>> restoredTetrahedra(std::span<const StoredTetrahedron> stored,
                                                           size_t probe_count);

// Fills in each tetrahedron's neighbours: those that share a face. False where one names a probe past `probe_count`,
// or three share a face. Time: linear, and n log n in the tetrahedra around one probe.
bool joinFaces(std::span<Tetrahedron> tetrahedra, size_t probe_count);

}  // namespace dimmer
