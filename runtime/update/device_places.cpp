#include <update/device_places.h>

#include <pack/batches.h>
#include <probes/grid_table.h>

#include <algorithm>
#include <initializer_list>

namespace dimmer {
namespace {

// A valid pack's batches fit their tiles.
void addBatch(const PackData& data, const Batch& batch, DevicePlaces& places) {
    const auto first = static_cast<uint32_t>(places.receivers.size());
    BatchTiles tiles;
    for (uint32_t i = 0; i < batch.receiver_count; ++i)
        places.receivers.push_back(tiles.add(data.addresses[batch.first_receiver + i]).value_or(0));
    const auto& [t0, t1, t2, t3] = tiles.tiles;
    places.batches.push_back(
        {first, tiles.page << 24 | (batch.receiver_count - 1) << 18 | t0, t3 << 18 | t1, (t3 >> 14) << 18 | t2});
}

}  // namespace

DevicePlaces placesOf(const PackData& data) {
    DevicePlaces places;
    for (const Cluster& cluster : data.clusters) {
        for (uint32_t b = cluster.first_batch; b < cluster.first_batch + cluster.batch_count; ++b)
            addBatch(data, data.batches[b], places);
        places.receivers.resize(paddedReceivers(static_cast<uint32_t>(places.receivers.size())));
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
    bytes.ancillary += tableBytes({16 * records, 8 * records, 4 * records, probes.numbers.size() * sizeof(uint32_t),
                                   probes.batches.size() * sizeof(BatchPlace), probes.batches.size() * sizeof(WorkItem),
                                   probes.terms.size() * sizeof(WorkTerm)}) -
                       records * sizeof(ProbeRecord);
}

}  // namespace

DeviceBytes deviceBytesOf(const PackData& data) {
    DeviceBytes bytes;
    bytes.base_lightmap = data.base_pages.size() * sizeof(TexelRecord);
    bytes.ancillary += data.probes.base.size() * sizeof(ProbeRecord) + gridTableBytes(data.probes.global);
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
    bytes.ancillary += tableBytes({(receivers + 3) / 4 * 4, receivers * sizeof(TexelRecord),
                                   records * sizeof(TexelRecord), data.batches.size() * sizeof(TexelBatch),
                                   data.batches.size() * sizeof(TexelItem), data.terms.size() * sizeof(WorkTerm)}) -
                       dynamic;
    return bytes;
}

}  // namespace dimmer
