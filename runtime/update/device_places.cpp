#include <update/device_places.h>

#include <algorithm>

namespace dimmer {
DevicePlaces placesOf(const PackData& data) {
    DevicePlaces places;
    for (const Cluster& cluster : data.clusters) {
        for (uint32_t b = cluster.first_batch; b < cluster.first_batch + cluster.batch_count; ++b) {
            const uint32_t offset = data.batches[b].first_receiver - cluster.first_receiver;
            places.batches.push_back({places.receivers + offset, data.batches[b].receiver_count, offset, 0});
        }
        places.receivers += paddedReceivers(cluster.receiver_count);
        places.records += uint64_t{paddedReceivers(cluster.receiver_count)} * cluster.term_count;
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
        receivers += paddedReceivers(cluster.receiver_count);
        records += uint64_t{paddedReceivers(cluster.receiver_count)} * cluster.term_count;
    }
    const uint64_t tables[] = {receivers * sizeof(uint32_t),           receivers * sizeof(TexelRecord),
                               records * sizeof(TexelRecord),          data.batches.size() * sizeof(BatchPlace),
                               data.batches.size() * sizeof(WorkItem), data.terms.size() * sizeof(WorkTerm)};
    for (const uint64_t table : tables) bytes.ancillary += std::max(table, texel_buffer_bytes_min);
    bytes.ancillary -= bytes.dynamic;  // of which the tables above are made too
    return bytes;
}

}  // namespace dimmer
