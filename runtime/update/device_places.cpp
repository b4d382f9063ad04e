#include <update/device_places.h>

#include <pack/batches.h>
#include <probes/grid_table.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <string_view>

namespace dimmer {
namespace {

// The places of batches, each way to lie in tiles once.
class SharedPlaces {
   public:
    SharedPlaces(std::vector<uint8_t>& bytes, size_t bytes_max) : bytes_(bytes) { bytes_.reserve(bytes_max); }

    // Fills `tiles` from an empty one, and returns where the batch's places begin. A valid pack's batches fit their
    // tiles.
    size_t add(std::span<const uint32_t> addresses, BatchTiles& tiles) {
        const size_t first = bytes_.size();
        for (const uint32_t address : addresses) bytes_.push_back(tiles.add(address).value_or(0));
        if (bytes_.size() % 2 != 0) bytes_.push_back(0);
        const std::string_view added(reinterpret_cast<const char*>(bytes_.data() + first), bytes_.size() - first);
        const auto [known, is_new] = first_.emplace(added, first);
        if (!is_new) bytes_.resize(first);
        return known->second;
    }

   private:
    std::vector<uint8_t>& bytes_;               // never reallocated: views point into it
    std::map<std::string_view, size_t> first_;  // by a batch's places; no file makes a map slow
};

TexelBatch texelBatch(uint64_t first_receiver, size_t first_place, uint32_t receivers, const BatchTiles& tiles) {
    const auto& [t0, t1, t2, t3] = tiles.tiles;
    const uint32_t step_2 = tiles.tile_count > 2 ? t2 - t1 : 0, step_3 = tiles.tile_count > 3 ? t3 - t2 : 0;
    return {(step_3 & 31) << 27 | static_cast<uint32_t>(first_receiver / 2),
            (step_3 >> 5 & 31) << 27 | static_cast<uint32_t>(first_place / 2),
            tiles.page << 24 | (receivers - 1) << 18 | t0, (step_3 >> 10) << 30 | step_2 << 18 | t1};
}

}  // namespace

DevicePlaces placesOf(const PackData& data) {
    DevicePlaces places;
    places.batches.reserve(data.batches.size());
    SharedPlaces shared(places.bytes, data.addresses.size() + data.batches.size());
    for (const Cluster& cluster : data.clusters) {
        for (uint32_t b = cluster.first_batch; b < cluster.first_batch + cluster.batch_count; ++b) {
            const auto& [first, count] = data.batches[b];
            BatchTiles tiles(data.page_width);
            const size_t place = shared.add(std::span(data.addresses).subspan(first, count), tiles);
            const uint64_t receiver = places.receivers + (first - cluster.first_receiver);
            places.batches.push_back(texelBatch(receiver, place, count, tiles));
        }
        places.receivers += paddedReceivers(cluster.receiver_count);
        places.records += uint64_t{paddedReceivers(cluster.receiver_count)} * cluster.term_count;
    }
    places.bytes.shrink_to_fit();
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
    const DevicePlaces places = placesOf(data);
    bytes.dynamic += dynamic;
    // Less the records and the base, which are in the tables and counted already.
    bytes.ancillary += tableBytes({(places.bytes.size() + 3) / 4 * 4, places.receivers * sizeof(TexelRecord),
                                   places.records * sizeof(TexelRecord), data.batches.size() * sizeof(TexelBatch),
                                   data.batches.size() * sizeof(TexelItem), data.terms.size() * sizeof(WorkTerm)}) -
                       dynamic;
    return bytes;
}

}  // namespace dimmer
