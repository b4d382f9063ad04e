// How fast a device's compute kernels can move bytes: what the update's speed is held against.
#pragma once

#include <gpu/kernel.h>
#include <gpu/transfer.h>
#include <gpu/update_timer.h>

#include <map>
#include <optional>
#include <utility>

namespace dimmer {

// What a copy stores into: a buffer, as fast as the device can, or page images, four bytes at a time, as an update has
// to.
enum class CopyTarget { Buffer, Pages };

class CopyRoof {
   public:
    // For copies of up to so many bytes. Unsupported on queues without timestamps, and where the device cannot read as
    // much as one buffer.
    static Expected<CopyRoof> create(const VulkanContext& vulkan, uint64_t read_bytes_max, uint64_t written_bytes_max);

    // Microseconds of one copy, 0 of one that no kernel is made for (more than 20 times as much read as written);
    // blocking. The kernel is the fastest of several workgroup sizes, of one or four stores per lane, and of loads from
    // streams apart or from one; found anew for each target and power of two of the bytes that are written.
    Expected<double> run(CopyTarget target, uint64_t read_bytes, uint64_t written_bytes);

   private:
    struct Image {
        GpuImage image;
        ImageViewHandle view;
    };
    Expected<void> createPages(const VulkanContext& vulkan, uint64_t written_bytes_max);
    Expected<void> createKernel(const VulkanContext& vulkan);
    Expected<double> runVariant(size_t variant, CopyTarget target, uint64_t read_bytes, uint64_t written_bytes);

    VulkanContext vulkan_;
    std::optional<Transfer> transfer_;
    std::optional<UpdateTimer> timer_;
    GpuTable source_;
    GpuBuffer target_;
    Image pages_[2];
    std::optional<Kernel> kernel_;
    std::map<std::pair<CopyTarget, int>, size_t> best_;  // per target and bit width of the bytes that are written
    uint32_t groups_x_max_ = 0, group_lanes_max_ = 0;
};

}  // namespace dimmer
