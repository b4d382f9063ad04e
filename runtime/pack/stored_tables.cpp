#include <pack/stored_tables.h>

#include <algorithm>
#include <array>
#include <tuple>

namespace dimmer {
namespace {

// A tetrahedron's side, filed under the lowest of its probes.
struct Face {
    uint32_t middle, highest;  // the other two
    uint32_t tetrahedron, opposite;
    auto probes() const { return std::tie(middle, highest); }
};

std::array<uint32_t, 3> faceOf(const Tetrahedron& t, uint32_t opposite) {
    std::array<uint32_t, 3> face;
    for (uint32_t i = 0, n = 0; i < 4; ++i)
        if (i != opposite) face[n++] = t.probes[i];
    std::ranges::sort(face);
    return face;
}

// A counting sort: the faces of one lowest probe stand together, those of probe p from first[p] on.
std::vector<Face> facesByLowestProbe(std::span<const Tetrahedron> tetrahedra, std::vector<size_t>& first) {
    for (const Tetrahedron& t : tetrahedra)
        for (uint32_t side = 0; side < 4; ++side) ++first[faceOf(t, side)[0] + 1];
    for (size_t p = 1; p < first.size(); ++p) first[p] += first[p - 1];
    std::vector<size_t> next(first.begin(), first.end());
    std::vector<Face> faces(4 * tetrahedra.size());
    for (uint32_t t = 0; t < tetrahedra.size(); ++t)
        for (uint32_t side = 0; side < 4; ++side) {
            const auto face = faceOf(tetrahedra[t], side);
            faces[next[face[0]]++] = {face[1], face[2], t, side};
        }
    return faces;
}

}  // namespace

StoredTables storedTables(const ReceiverView& tables) {
    StoredTables stored;
    for (const Cluster& c : tables.clusters) stored.clusters.push_back({c.receiver_count, c.batch_count, c.term_count});
    for (const ClusterTerm& term : tables.terms) stored.terms.push_back(term.contribution);
    for (const Batch& batch : tables.batches) stored.batches.push_back(batch.receiver_count);
    return stored;
}

ReceiverTables restored(const StoredTables& stored, std::span<const uint32_t> record_counts) {
    std::vector<uint32_t> next_record;
    uint32_t records = 0;
    for (const uint32_t count : record_counts) {
        next_record.push_back(records);
        records += count;
    }
    ReceiverTables tables;
    uint32_t receiver = 0, batch = 0, term = 0;
    for (const StoredCluster& c : stored.clusters) {
        tables.clusters.push_back({receiver, c.receiver_count, batch, c.batch_count, term, c.term_count});
        for (uint32_t t = 0; t < c.term_count && tables.terms.size() < stored.terms.size(); ++t) {
            const uint32_t contribution = stored.terms[tables.terms.size()];
            const bool known = contribution < next_record.size();
            tables.terms.push_back({contribution, known ? next_record[contribution] : 0});
            if (known) next_record[contribution] += c.receiver_count;
        }
        receiver += c.receiver_count;
        batch += c.batch_count;
        term += c.term_count;
    }
    // Terms of no cluster: kept, so that validate() sees them.
    for (size_t t = tables.terms.size(); t < stored.terms.size(); ++t) tables.terms.push_back({stored.terms[t], 0});
    receiver = 0;
    for (const uint32_t count : stored.batches) {
        tables.batches.push_back({receiver, count});
        receiver += count;
    }
    return tables;
}

bool joinFaces(std::span<Tetrahedron> tetrahedra, size_t probe_count) {
    for (Tetrahedron& t : tetrahedra) {
        if (!std::ranges::all_of(t.probes, [&](uint32_t probe) { return probe < probe_count; })) return false;
        t.neighbours.fill(no_tetrahedron);
    }
    std::vector<size_t> first(probe_count + 1, 0);
    std::vector<Face> faces = facesByLowestProbe(tetrahedra, first);
    for (size_t p = 0; p < probe_count; ++p) {
        const auto here = std::span(faces).subspan(first[p], first[p + 1] - first[p]);
        std::ranges::sort(here, {}, &Face::probes);
        for (size_t i = 1; i < here.size(); ++i) {
            const Face &a = here[i - 1], &b = here[i];
            if (a.probes() != b.probes()) continue;
            if (i > 1 && here[i - 2].probes() == a.probes()) return false;
            tetrahedra[a.tetrahedron].neighbours[a.opposite] = b.tetrahedron;
            tetrahedra[b.tetrahedron].neighbours[b.opposite] = a.tetrahedron;
        }
    }
    return true;
}

}  // namespace dimmer
