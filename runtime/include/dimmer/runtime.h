// The Vulkan runtime: blends a pack's records into lightmap images by compute whenever a weight changed.
#pragma once

#include <dimmer/light_state.h>

#include <vulkan/vulkan.h>

#include <memory>
#include <vector>

namespace dimmer {

// The caller's device; it must outlive the runtime. Needs Vulkan 1.2 and a queue family with compute; no optional
// feature beyond timelineSemaphore (core in 1.2), which submit() uses.
struct VulkanContext {
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical_device = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    uint32_t queue_family = 0;
};

// How pages are updated. All give the same bits; every one but the first is there to be compared and to check with.
enum class UpdateMode {
    WorkList,        // one dispatch per number of contributions that are on
    PerCombination,  // one dispatch per changed cluster
    Gather,          // a list of records per texel; all texels whenever anything changed
    Scatter,         // one pass per contribution over 32-bit sums; all texels whenever anything changed
};

struct RuntimeOptions {
    UpdateMode mode = UpdateMode::WorkList;
    // Write GPU timestamps around each update, read by stats(). Off costs nothing.
    bool timestamps = true;
};

// The lightmap as a shader samples it: 2D arrays, one layer per page, in SHADER_READ_ONLY_OPTIMAL between updates.
struct LightmapImages {
    VkImage irradiance = VK_NULL_HANDLE;           // B10G11R11_UFLOAT_PACK32; lux * exposure
    VkImageView irradiance_view = VK_NULL_HANDLE;  // VK_IMAGE_VIEW_TYPE_2D_ARRAY
    VkImage direction = VK_NULL_HANDLE;            // A2B10G10R10_UNORM_PACK32; see sample.glsl
    VkImageView direction_view = VK_NULL_HANDLE;
    VkSampler sampler = VK_NULL_HANDLE;  // bilinear, clamp to edge
    uint32_t width = 0, height = 0, layers = 0;
};

// What a runtime keeps on the device between updates.
struct DeviceFootprint {
    uint64_t bytes = 0;      // memory of buffers and images; what drivers add to align it is not counted
    uint32_t pipelines = 0;  // compute pipelines
};

// Not thread-safe; external synchronisation of the queue is the caller's, as in Vulkan itself.
class Runtime : public LightState {
   public:
    // Uploads the pack's records and the base pages (blocking). Device memory: what `dimmer inspect` states.
    static Expected<Runtime> create(const VulkanContext& vulkan, const Pack& pack, const RuntimeOptions& options = {});
    // Waits for what submit() sent; what was record()ed must have completed, as for any Vulkan object.
    ~Runtime();
    Runtime(Runtime&&) noexcept;
    Runtime& operator=(Runtime&&) noexcept;

    // Records the update into the caller's command buffer, outside a render pass: one dispatch per number of
    // contributions that are on, with the barriers that let fragment and compute shaders sample afterwards. Nothing
    // changed: records nothing. One recording may be in flight at a time: before the next, the earlier submission
    // must have completed on the GPU.
    Expected<UpdateStats> record(VkCommandBuffer commands);

    // The same on the context's queue, with a command buffer of the runtime's own. Returns at once; a later call waits
    // for the earlier update. Nothing changed: no submission.
    Expected<UpdateStats> submit();
    // The timeline semaphore of submit() and the value that its last submission signals.
    VkSemaphore semaphore() const;
    uint64_t semaphoreValue() const;
    // Blocks until what submit() sent is done. Statistics of the last update, GPU time included; after record(), call
    // it once the commands have completed.
    Expected<UpdateStats> wait();

    LightmapImages images() const;
    // In mode WorkList: the device memory that `dimmer inspect` states. A level without a light set or door that
    // changes anything has its pages and nothing else.
    DeviceFootprint footprint() const;

    // Copies the pages to host memory (blocking; for tools and tests), layout as in CpuRuntime.
    struct Pages {
        std::vector<uint32_t> irradiance, direction;
    };
    Expected<Pages> readPages();

   private:
    struct Impl;
    Runtime(const Pack& pack, std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace dimmer
