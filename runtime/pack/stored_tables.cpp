#include <pack/stored_tables.h>

#include <algorithm>
#include <array>
#include <utility>

namespace dimmer {
namespace {

// A side of a tetrahedron, filed under the lowest of its probes.
struct Face {
    uint64_t others;  // the other two, the middle one first
    uint32_t tetrahedron, opposite;
};

// Calls visit(lowest probe, face) for the four sides.
void visitFaces(const Tetrahedron& t, uint32_t number, auto&& visit) {
    std::array<uint32_t, 4> order = {0, 1, 2, 3};
    auto ascend = [&](size_t a, size_t b) {
        if (t.probes[order[b]] < t.probes[order[a]]) std::swap(order[a], order[b]);
    };
    ascend(0, 1), ascend(2, 3), ascend(0, 2), ascend(1, 3), ascend(1, 2);
    const uint64_t a = t.probes[order[0]], b = t.probes[order[1]], c = t.probes[order[2]], d = t.probes[order[3]];
    visit(b, Face{c << 32 | d, number, order[0]});
    visit(a, Face{c << 32 | d, number, order[1]});
    visit(a, Face{b << 32 | d, number, order[2]});
    visit(a, Face{b << 32 | c, number, order[3]});
}

// A counting sort: the faces of one lowest probe stand together, those of probe p from first[p] on.
std::vector<Face> facesByLowestProbe(std::span<const Tetrahedron> tetrahedra, std::vector<size_t>& first) {
    for (const Tetrahedron& t : tetrahedra)
        visitFaces(t, 0, [&](uint64_t lowest, const Face&) { ++first[lowest + 1]; });
    for (size_t p = 1; p < first.size(); ++p) first[p] += first[p - 1];
    std::vector<size_t> next(first.begin(), first.end());
    std::vector<Face> faces(4 * tetrahedra.size());
    for (uint32_t i = 0; i < tetrahedra.size(); ++i)
        visitFaces(tetrahedra[i], i, [&](uint64_t lowest, const Face& face) { faces[next[lowest]++] = face; });
    return faces;
}

// Probes' numbers beside the highest so far.
class ProbeNames {
   public:
    explicit ProbeNames(size_t probe_count)
        : plain_count_(static_cast<uint32_t>(probe_count - std::min(probe_count, grid_box_corners))) {}
    uint32_t nameOf(uint32_t probe) {
        const uint32_t name = next_ - probe;
        count(probe);
        return name;
    }
    uint32_t probeOf(uint32_t name) {
        const uint32_t probe = next_ - name;
        count(probe);
        return probe;
    }

   private:
    void count(uint32_t probe) {
        if (probe < plain_count_) next_ = std::max(next_, probe + 1);
    }
    uint32_t plain_count_, next_ = 0;
};

// Of `earlier`, the corner that `t` has another probe at; 4: more than one.
size_t cornerThatDiffers(const Tetrahedron& earlier, const Tetrahedron& t) {
    size_t corner = 4;
    for (size_t k = 0; k < 4; ++k) {
        if (earlier.probes[k] == t.probes[k]) continue;
        if (corner != 4) return 4;
        corner = k;
    }
    return corner;
}

// `from` of the nearest earlier neighbour that `t`, number `i`, can be told by; 0: none.
uint32_t tellingNeighbour(std::span<const Tetrahedron> tetrahedra, uint32_t i) {
    uint32_t from = 0;
    for (const uint32_t n : tetrahedra[i].neighbours) {
        if (n >= i) continue;  // no_tetrahedron, too
        const size_t corner = cornerThatDiffers(tetrahedra[n], tetrahedra[i]);
        if (corner == 4 || (from != 0 && from / 4 < i - n)) continue;
        from = 4 * (i - n) + static_cast<uint32_t>(corner);
    }
    return from;
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

std::vector<StoredTetrahedron> storedTetrahedra(std::span<const Tetrahedron> tetrahedra, size_t probe_count) {
    std::vector<StoredTetrahedron> stored;
    stored.reserve(tetrahedra.size() + 3);
    ProbeNames names(probe_count);
    for (uint32_t i = 0; i < tetrahedra.size(); ++i) {
        const auto& probes = tetrahedra[i].probes;
        if (const uint32_t from = tellingNeighbour(tetrahedra, i)) {
            stored.push_back({from, names.nameOf(probes[from % 4])});
        } else {
            for (const uint32_t probe : probes) stored.push_back({0, names.nameOf(probe)});
        }
    }
    return stored;
}

std::optional<std::vector<Tetrahedron>> restoredTetrahedra(std::span<const StoredTetrahedron> stored,
                                                           size_t probe_count) {
    std::vector<Tetrahedron> tetrahedra;
    tetrahedra.reserve(stored.size());
    ProbeNames names(probe_count);
    for (size_t i = 0; i < stored.size(); ++i) {
        Tetrahedron t;
        if (stored[i].from == 0) {
            if (stored.size() - i < 4) return {};
            for (size_t k = 0; k < 4; ++k) {
                if (stored[i + k].from != 0) return {};
                t.probes[k] = names.probeOf(stored[i + k].probe);
            }
            i += 3;
        } else {
            const size_t back = stored[i].from / 4;
            if (back == 0 || back > tetrahedra.size()) return {};
            t = tetrahedra[tetrahedra.size() - back];
            t.probes[stored[i].from % 4] = names.probeOf(stored[i].probe);
        }
        tetrahedra.push_back(t);
    }
    if (!joinFaces(tetrahedra, probe_count)) return {};
    return tetrahedra;
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
        std::ranges::sort(here, {}, &Face::others);
        for (size_t i = 1; i < here.size(); ++i) {
            const Face &a = here[i - 1], &b = here[i];
            if (a.others != b.others) continue;
            if (i > 1 && here[i - 2].others == a.others) return false;
            tetrahedra[a.tetrahedron].neighbours[a.opposite] = b.tetrahedron;
            tetrahedra[b.tetrahedron].neighbours[b.opposite] = a.tetrahedron;
        }
    }
    return true;
}

}  // namespace dimmer
