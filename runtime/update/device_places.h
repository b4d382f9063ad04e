// Where the device keeps what updates read, and what that costs. No Vulkan in it: executor and `dimmer inspect` agree.
#pragma once

#include <pack/pack_data.h>

#include <dimmer/work_list.glsl>
#include <vector>

namespace dimmer {

// The pack's order, with gaps: a lane loads two receivers at once, so every cluster starts at an even place, in
// receivers and in records.
constexpr uint32_t paddedReceivers(uint32_t receivers) {
    return (receivers + 1) / 2 * 2;
}

struct DevicePlaces {
    std::vector<TexelBatch> batches;
    // BatchTiles::add of each batch's receivers, an even number; batches that lie alike in their tiles share theirs, as
    // most whole tiles do.
    std::vector<uint8_t> bytes;
    uint64_t receivers = 0, records = 0;  // gaps included
};

// Receivers that a TexelBatch can name.
inline constexpr uint64_t device_receivers_max = uint64_t{2} << 27;

// Of a pack with more than device_receivers_max, batches are of no use.
DevicePlaces placesOf(const PackData& data);

inline uint32_t firstReceiver(const TexelBatch& batch) {
    return (batch.first_receivers & (device_receivers_max / 2 - 1)) * 2;
}

// Device memory in bytes of the default mode, pages in place; what drivers add to align it is not counted.
struct DeviceBytes {
    uint64_t base_lightmap = 0;  // the page images
    uint64_t dynamic = 0;        // records of every contribution, and the base of the receivers that they touch
    uint64_t ancillary = 0;  // places, tables, the largest work list, gaps between clusters, and the probes themselves
    uint64_t total() const { return base_lightmap + dynamic + ancillary; }
};

DeviceBytes deviceBytesOf(const PackData& data);

// Texel buffers are never empty: what nothing reads still needs a view to bind.
inline constexpr uint64_t texel_buffer_bytes_min = 16;

}  // namespace dimmer
