// The records of contributions on the device: one buffer, in which each contribution has a range while it is loaded.
#pragma once

#include <gpu/kernel.h>
#include <gpu/table_upload.h>
#include <gpu/transfer.h>
#include <update/device_places.h>
#include <update/record_pool.h>

#include <optional>

namespace dimmer {

class RecordStore {
   public:
    // Room for `bytes_max` of records, 0 for all of them. `data` must outlive it.
    static Expected<RecordStore> create(const VulkanContext& vulkan, const PackData& data, uint64_t bytes_max);

    const GpuTable& table() const { return buffer_; }
    VkBuffer buffer() const { return buffer_.buffer.buffer.get(); }
    uint64_t deviceBytes() const { return buffer_.buffer.size_bytes; }

    // A range for the contribution's records; they are still to be written. Where there is room for all, each has its
    // own. False: no free range is long enough.
    bool reserve(uint32_t contribution);
    // Its range is free for others. Commands that read it must be submitted before those that write others there.
    void release(uint32_t contribution);
    bool reserved(uint32_t contribution) const { return first_[contribution].has_value(); }

    // Where the range begins and how long it is, in bytes of the buffer.
    uint64_t firstByte(uint32_t contribution) const;
    uint64_t byteCount(uint32_t contribution) const { return counts_[contribution] * sizeof(TexelRecord); }
    // In no contribution's range; and in the largest range of those. Where there is room for all, all of it is one.
    uint64_t freeBytes() const;
    uint64_t largestFreeBytes() const;
    // Writes the contribution's records, from `offset` bytes into them.
    void fill(uint32_t contribution, uint64_t offset, std::span<std::byte> piece) const;
    // To which the place of a receiver (DevicePlaces) is added for its record of a term of the pack; wraps.
    uint32_t firstRecord(uint32_t term) const {
        return within_[term] + static_cast<uint32_t>(first_[data_->terms[term].contribution].value_or(0));
    }

   private:
    const PackData* data_ = nullptr;
    GpuTable buffer_;
    RecordPool pool_;             // where there is not room for all
    std::vector<uint64_t> home_;  // per contribution, its range where there is room for all; empty where there is not
    std::vector<std::optional<uint64_t>> first_;  // per contribution
    std::vector<uint64_t> counts_;                // likewise, gaps included
    std::vector<uint32_t> within_;                // per term, within its contribution, less the cluster's place
    std::vector<std::vector<Run>> runs_;          // per contribution
};

}  // namespace dimmer
