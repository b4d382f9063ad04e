#include <cluster/cluster.h>

#include <cluster/texel_groups.h>
#include <encode/encode.h>
#include <encode/encode_probe.h>
#include <pack/batches.h>

#include <tbb/parallel_for.h>

#include <glm/gtc/bitfield.hpp>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <numeric>

namespace dimmer::cook {
namespace {

// Contributions of a row of light, ascending.
template <class Light>
std::vector<uint32_t> contributionsOf(std::span<const LightOfTerm<Light>> light,
                                      std::span<const uint32_t> contribution_of_term) {
    std::vector<uint32_t> list;
    for (const auto& l : light)
        if (l.term != always_group) list.push_back(contribution_of_term[l.term]);
    return list;
}

// Clusters by their number of contributions, as updates take them, and in their items' order among equals: what a
// dispatch reads lies together, and neighbours in the file are neighbours on the page.
std::vector<Group> ordered(std::vector<Group> groups) {
    std::ranges::sort(groups, {}, [](const Group& g) { return std::pair(g.contributions.size(), g.items.front()); });
    return groups;
}

// What clusters of one kind of receiver are told by.
template <class Record>
struct Tables {
    std::vector<Cluster>& clusters;
    std::vector<ClusterTerm>& terms;
    std::vector<Batch>& batches;
    std::vector<uint32_t>& receivers;  // addresses of texels, numbers of probes
    std::vector<Record>& payload;
};

void appendCluster(const std::vector<uint32_t>& contributions, uint32_t receivers, auto& tables,
                   std::vector<uint32_t>& record_counts, auto&& cut) {
    Cluster c{.first_receiver = static_cast<uint32_t>(tables.receivers.size()) - receivers,
              .receiver_count = receivers,
              .first_batch = static_cast<uint32_t>(tables.batches.size()),
              .batch_count = 0,
              .first_term = static_cast<uint32_t>(tables.terms.size()),
              .term_count = static_cast<uint32_t>(contributions.size())};
    cut(c.first_receiver, receivers);
    c.batch_count = static_cast<uint32_t>(tables.batches.size()) - c.first_batch;
    for (uint32_t k : contributions) {
        tables.terms.push_back({k, record_counts[k]});  // relative to the contribution for now
        record_counts[k] += receivers;
    }
    tables.clusters.push_back(c);
}

// `receiverOf(item)`: its address or number; `lightOf(item)`: its row; `encode(light)`: a record; `cut(first, count)`
// appends the batches of a cluster's receivers. Returns the number of records per contribution.
template <class Record>
std::vector<uint32_t> fillTables(const std::vector<Group>& clusters, std::span<const uint32_t> contribution_of_term,
                                 size_t contributions, Tables<Record> tables, auto&& receiverOf, auto&& lightOf,
                                 auto&& encode, auto&& cut) {
    std::vector<uint32_t> record_counts(contributions, 0);
    for (const Group& cluster : clusters) {
        for (uint32_t item : cluster.items) tables.receivers.push_back(receiverOf(item));
        appendCluster(cluster.contributions, static_cast<uint32_t>(cluster.items.size()), tables, record_counts, cut);
    }
    std::vector<uint32_t> first_record(contributions + 1, 0);
    std::partial_sum(record_counts.begin(), record_counts.end(), first_record.begin() + 1);
    for (ClusterTerm& term : tables.terms) term.first_record += first_record[term.contribution];
    tables.payload.assign(first_record.back(), encode({}));  // contributions that a receiver of a cluster does not have
    tbb::parallel_for(size_t{0}, clusters.size(), [&](size_t c) {
        const std::vector<uint32_t>& items = clusters[c].items;
        for (size_t i = 0; i < items.size(); ++i) {
            size_t term = tables.clusters[c].first_term;
            for (const auto& l : lightOf(items[i])) {
                if (l.term == always_group) continue;
                while (tables.terms[term].contribution != contribution_of_term[l.term]) ++term;
                tables.payload[tables.terms[term].first_record + i] = encode(l.light);
            }
        }
    });
    return record_counts;
}

// Every 16 consecutive places of a space-filling curve (Morton) through the global grid are a tile, and as many
// probes of models' grids, which follow each other there.
std::vector<uint64_t> probeTiles(std::span<const ProbePosition> positions, size_t probes) {
    constexpr size_t probes_per_tile = 16;
    glm::vec3 lower(std::numeric_limits<float>::max()), upper(std::numeric_limits<float>::lowest());
    for (const ProbePosition& p : positions) {
        lower = glm::min(lower, {p.x_m, p.y_m, p.z_m});
        upper = glm::max(upper, {p.x_m, p.y_m, p.z_m});
    }
    const float side_m = std::max({upper.x - lower.x, upper.y - lower.y, upper.z - lower.z, 1e-3f});
    std::vector<std::pair<uint64_t, uint32_t>> curve;
    for (uint32_t i = 0; i < positions.size(); ++i) {
        const glm::vec3 p(positions[i].x_m, positions[i].y_m, positions[i].z_m);
        const glm::u16vec3 cell((p - lower) / side_m * 65535.0f);
        curve.emplace_back(glm::bitfieldInterleave(cell.x, cell.y, cell.z), i);
    }
    std::ranges::sort(curve);
    std::vector<uint64_t> tiles(probes);
    for (size_t rank = 0; rank < curve.size(); ++rank) tiles[curve[rank].second] = rank / probes_per_tile;
    for (size_t i = curve.size(); i < probes; ++i) tiles[i] = probes + i / probes_per_tile;
    return tiles;
}

}  // namespace

void buildClusters(const Texels& texels, const Baked& baked, std::span<const uint32_t> contribution_of_term,
                   uint32_t overlap_max, PackData& pack) {
    const std::vector<ShownTexel> shown = listTexels(texels);
    const TexelEncoding encoding{pack.exposure, pack.color_format, pack.direction_model};
    pack.base_pages.assign(size_t{pack.page_count} * pack.page_height * pack.page_width, encodeTexel({}, encoding));
    tbb::parallel_for(size_t{0}, shown.size(), [&](size_t t) {
        for (const ReceiverLight& l : baked.light.row(shown[t].source))
            if (l.term == always_group)
                pack.base_pages[texelIndex(pack, shown[t].address)] = encodeTexel(l.light, encoding);
    });
    const auto listOf = [&](uint32_t receiver) {
        return contributionsOf(baked.light.row(receiver), contribution_of_term);
    };
    const auto counts = fillTables<TexelRecord>(
        ordered(groupTexels(shown, listOf, overlap_max)), contribution_of_term, pack.contributions.size(),
        {pack.clusters, pack.terms, pack.batches, pack.addresses, pack.payload},
        [&](uint32_t t) { return shown[t].address; }, [&](uint32_t t) { return baked.light.row(shown[t].source); },
        [&](const Gathered& light) { return encodeTexel(light, encoding); },
        [&](uint32_t first, uint32_t) { cutIntoBatches(pack.addresses, pack.page_width, first, pack.batches); });
    for (size_t k = 0; k < counts.size(); ++k) pack.contributions[k].receivers = counts[k];
}

void buildProbeClusters(const Baked& baked, std::span<const uint32_t> contribution_of_term, uint32_t overlap_max,
                        PackData& pack) {
    const size_t global = baked.grid.light.rows(), all = global + baked.local_light.rows();
    if (all == 0) return;
    const auto row = [&](size_t i) { return i < global ? baked.grid.light.row(i) : baked.local_light.row(i - global); };
    ProbeData& probes = pack.probes;
    const ProbeEncoding encoding{pack.exposure, pack.color_format};
    probes.base.assign(all, encodeProbe({}, encoding));
    Grouping grouping;
    for (uint32_t i = 0; i < all; ++i) grouping.add(i, 0, contributionsOf(row(i), contribution_of_term));
    tbb::parallel_for(size_t{0}, all, [&](size_t i) {
        for (const ProbeTermLight& l : row(i))
            if (l.term == always_group) probes.base[i] = encodeProbe(l.light, encoding);
    });
    probes.record_counts = fillTables<ProbeRecord>(
        ordered(mergeGroups(std::move(grouping).groups(), probeTiles(baked.grid.grid.positions, all), probe_group_bytes,
                            overlap_max)),
        contribution_of_term, pack.contributions.size(),
        {probes.clusters, probes.terms, probes.batches, probes.numbers, probes.payload}, std::identity{}, row,
        [&](const ProbeLight& light) { return encodeProbe(light, encoding); },
        [&](uint32_t first, uint32_t count) {
            for (uint32_t done = 0; done < count; done += batch_receivers_max)
                probes.batches.push_back({first + done, std::min(batch_receivers_max, count - done)});
        });
    probes.global = baked.grid.grid;
}

}  // namespace dimmer::cook
