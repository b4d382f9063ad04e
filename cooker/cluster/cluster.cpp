#include <cluster/cluster.h>

#include <encode/encode.h>
#include <pack/batches.h>

#include <algorithm>
#include <map>

namespace dimmer::cook {
namespace {

// A texel of a page, whether baked or a copy.
struct Target {
    uint64_t order;  // page, tile row, tile column, then inside the tile
    uint32_t address;
    uint32_t source;  // receiver whose light it shows
};

uint64_t tileOrder(uint32_t address) {
    const uint64_t x = TexelAddress::x(address), y = TexelAddress::y(address);
    return uint64_t{TexelAddress::page(address)} << 32 | (y >> 3) << 20 | (x >> 3) << 8 | (y & 7) << 3 | (x & 7);
}

std::vector<Target> listTargets(const Texels& texels) {
    std::vector<Target> targets;
    targets.reserve(texels.size() + texels.fills.size());
    for (uint32_t i = 0; i < texels.size(); ++i)
        targets.push_back({tileOrder(texels.address[i]), texels.address[i], i});
    for (const FillTexel& f : texels.fills) targets.push_back({tileOrder(f.address), f.address, f.source});
    std::ranges::sort(targets, {}, &Target::order);
    return targets;
}

size_t pageIndex(const PackData& pack, uint32_t address) {
    return (size_t{TexelAddress::page(address)} * pack.page_height + TexelAddress::y(address)) * pack.page_width +
           TexelAddress::x(address);
}

void appendCluster(const std::vector<uint32_t>& contributions, uint32_t receivers, PackData& pack) {
    Cluster c{.first_receiver = static_cast<uint32_t>(pack.addresses.size()) - receivers,
              .receiver_count = receivers,
              .first_batch = static_cast<uint32_t>(pack.batches.size()),
              .batch_count = 0,
              .first_term = static_cast<uint32_t>(pack.terms.size()),
              .term_count = static_cast<uint32_t>(contributions.size())};
    cutIntoBatches(pack.addresses, c.first_receiver, pack.batches);
    c.batch_count = static_cast<uint32_t>(pack.batches.size()) - c.first_batch;
    for (uint32_t k : contributions) {
        pack.terms.push_back({k, pack.contributions[k].receivers});  // relative to the contribution for now
        pack.contributions[k].receivers += receivers;
    }
    pack.clusters.push_back(c);
}

}  // namespace

void buildClusters(const Texels& texels, const Baked& baked, std::span<const uint32_t> contribution_of_term,
                   PackData& pack) {
    const std::vector<Target> targets = listTargets(texels);
    const TexelEncoding encoding{pack.exposure, pack.color_format, pack.direction_model};
    pack.base_pages.assign(size_t{pack.page_count} * pack.page_height * pack.page_width, encodeTexel({}, encoding));
    using Signature = std::pair<std::vector<uint32_t>, uint32_t>;  // contributions and page
    std::map<Signature, std::vector<uint32_t>> members;            // -> targets
    Signature signature;
    for (uint32_t t = 0; t < targets.size(); ++t) {
        signature = {{}, TexelAddress::page(targets[t].address)};
        for (const ReceiverLight& l : baked.light.row(targets[t].source)) {
            if (l.term == always_group)
                pack.base_pages[pageIndex(pack, targets[t].address)] = encodeTexel(l.light, encoding);
            else
                signature.first.push_back(contribution_of_term[l.term]);
        }
        if (!signature.first.empty()) members[signature].push_back(t);
    }
    // Clusters by their number of contributions, as updates take them, and in page order among equals: what a dispatch
    // reads lies together, and neighbours in the file are neighbours on the page.
    std::vector<const std::pair<const Signature, std::vector<uint32_t>>*> order;
    for (const auto& cluster : members) order.push_back(&cluster);
    std::ranges::sort(order, {}, [](const auto* c) { return std::pair(c->first.first.size(), c->second.front()); });

    std::vector<std::vector<TexelRecord>> payloads(pack.contributions.size());
    for (const auto* cluster : order) {
        for (uint32_t t : cluster->second) {
            pack.addresses.push_back(targets[t].address);
            for (const ReceiverLight& l : baked.light.row(targets[t].source))
                if (l.term != always_group)
                    payloads[contribution_of_term[l.term]].push_back(encodeTexel(l.light, encoding));
        }
        appendCluster(cluster->first.first, static_cast<uint32_t>(cluster->second.size()), pack);
    }
    std::vector<uint32_t> first_record;
    for (const auto& payload : payloads) {
        first_record.push_back(static_cast<uint32_t>(pack.payload.size()));
        pack.payload.insert(pack.payload.end(), payload.begin(), payload.end());
    }
    for (ClusterTerm& term : pack.terms) term.first_record += first_record[term.contribution];
}

}  // namespace dimmer::cook
