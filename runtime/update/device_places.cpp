#include <update/device_places.h>

#include <algorithm>

namespace dimmer {
namespace {

constexpr uint32_t padded(uint32_t receivers) {
    return (receivers + 1) / 2 * 2;
}

// Where the records of each contribution begin, gaps included; one more at the end.
std::vector<uint64_t> firstRecords(const PackData& data) {
    std::vector<uint64_t> first(data.contributions.size() + 1, 0);
    for (const Cluster& cluster : data.clusters)
        for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t)
            first[data.terms[t].contribution + 1] += padded(cluster.receiver_count);
    for (size_t k = 1; k < first.size(); ++k) first[k] += first[k - 1];
    return first;
}

}  // namespace

DevicePlaces placesOf(const PackData& data) {
    std::vector<uint64_t> next = firstRecords(data);
    DevicePlaces places;
    places.records = next.back();
    for (const Cluster& cluster : data.clusters) {
        const auto first_record = static_cast<uint32_t>(places.first_records.size());
        for (uint32_t b = cluster.first_batch; b < cluster.first_batch + cluster.batch_count; ++b) {
            const uint32_t offset = data.batches[b].first_receiver - cluster.first_receiver;
            places.batches.push_back({places.receivers + offset, data.batches[b].receiver_count, offset, first_record});
        }
        places.receivers += padded(cluster.receiver_count);
        for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t) {
            uint64_t& first = next[data.terms[t].contribution];
            places.first_records.push_back(static_cast<uint32_t>(first));
            first += padded(cluster.receiver_count);
        }
    }
    return places;
}

DeviceBytes deviceBytesOf(const PackData& data) {
    DeviceBytes bytes;
    bytes.base_lightmap = data.base_pages.size() * sizeof(TexelRecord);
    if (data.payload.empty()) return bytes;  // nothing ever changes
    bytes.dynamic = (data.payload.size() + data.addresses.size()) * sizeof(TexelRecord);
    uint64_t receivers = 0, records = 0;
    for (const Cluster& cluster : data.clusters) {
        receivers += padded(cluster.receiver_count);
        records += uint64_t{padded(cluster.receiver_count)} * cluster.term_count;
    }
    const uint64_t tables[] = {receivers * sizeof(uint32_t),         receivers * sizeof(TexelRecord),
                               records * sizeof(TexelRecord),        data.batches.size() * sizeof(BatchPlace),
                               data.terms.size() * sizeof(uint32_t), data.batches.size() * sizeof(WorkItem),
                               data.terms.size() * sizeof(WorkTerm)};
    for (const uint64_t table : tables) bytes.ancillary += std::max(table, texel_buffer_bytes_min);
    bytes.ancillary -= bytes.dynamic;  // of which the tables above are made too
    return bytes;
}

}  // namespace dimmer
