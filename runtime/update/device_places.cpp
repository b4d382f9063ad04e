#include <update/device_places.h>

#include <algorithm>
#include <initializer_list>

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

namespace {

uint64_t tableBytes(std::initializer_list<uint64_t> tables) {
    uint64_t bytes = 0;
    for (const uint64_t table : tables) bytes += std::max(table, texel_buffer_bytes_min);
    return bytes;
}

void addProbes(const ProbeData& probes, DeviceBytes& bytes) {
    const uint64_t records = probes.payload.size() + probes.numbers.size();
    bytes.dynamic += records * sizeof(ProbeRecord);
    bytes.ancillary += probes.base.size() * sizeof(ProbeRecord) - records * sizeof(ProbeRecord) +
                       tableBytes({16 * records, 8 * records, 4 * records, probes.numbers.size() * sizeof(uint32_t),
                                   probes.batches.size() * sizeof(BatchPlace), probes.batches.size() * sizeof(WorkItem),
                                   probes.terms.size() * sizeof(WorkTerm)});
}

}  // namespace

DeviceBytes deviceBytesOf(const PackData& data) {
    DeviceBytes bytes;
    bytes.base_lightmap = data.base_pages.size() * sizeof(TexelRecord);
    if (!data.probes.payload.empty()) addProbes(data.probes, bytes);
    if (data.payload.empty()) return bytes;  // no texel ever changes
    const uint64_t dynamic = (data.payload.size() + data.addresses.size()) * sizeof(TexelRecord);
    uint64_t receivers = 0, records = 0;
    for (const Cluster& cluster : data.clusters) {
        receivers += paddedReceivers(cluster.receiver_count);
        records += uint64_t{paddedReceivers(cluster.receiver_count)} * cluster.term_count;
    }
    bytes.dynamic += dynamic;
    // Less the records and the base, which are in the tables and counted already.
    bytes.ancillary += tableBytes({receivers * sizeof(uint32_t), receivers * sizeof(TexelRecord),
                                   records * sizeof(TexelRecord), data.batches.size() * sizeof(BatchPlace),
                                   data.batches.size() * sizeof(WorkItem), data.terms.size() * sizeof(WorkTerm)}) -
                       dynamic;
    return bytes;
}

}  // namespace dimmer
