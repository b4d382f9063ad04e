// The lightmap pages as two image arrays: sampled in their own formats, written by compute through R32_UINT views.
#pragma once

#include <gpu/transfer.h>
#include <pack/pack_data.h>

namespace dimmer {

// Whether the device has images of so many texels of 4 bytes: Unsupported, with the mend, where it does not.
Expected<void> checkPageLimits(const VkImageFormatProperties& limits, uint32_t width, uint32_t height, uint32_t layers);

class LightmapPages {
   public:
    // Creates the images and fills them with the base; blocking. They end in SHADER_READ_ONLY_OPTIMAL.
    static Expected<LightmapPages> create(const VulkanContext& vulkan, const PackData& data, Transfer& transfer);

    LightmapImages images() const;
    // Where shaders sample what updates write.
    VkPipelineStageFlags readers(bool drawing) const { return sampled(drawing).stages; }
    uint64_t deviceBytes() const { return irradiance_.image.size_bytes + direction_.image.size_bytes; }
    VkImageView irradianceStorageView() const { return irradiance_.storage_view.get(); }
    VkImageView directionStorageView() const { return direction_.storage_view.get(); }

    // Around the dispatches that write pages. The first waits for what sampled them earlier on the queue, the second
    // lets later commands sample. `drawing`: false on a queue of its own, which may know no other stage than compute;
    // between queues a semaphore does the rest.
    void beginWrites(VkCommandBuffer commands, bool drawing) const;
    void endWrites(VkCommandBuffer commands, bool drawing) const;

    // Blocking; both in the layout of CpuRuntime's pages.
    Expected<Runtime::Pages> read(Transfer& transfer) const;

   private:
    struct PageArray {
        GpuImage image;
        ImageViewHandle sampled_view, storage_view;
    };
    struct State {
        VkImageLayout layout;
        VkPipelineStageFlags stages;
        VkAccessFlags access;
    };

    Expected<PageArray> createArray(const VulkanContext& vulkan, VkFormat format) const;
    Expected<void> createSampler(const VulkanContext& vulkan);
    void transition(VkCommandBuffer commands, const State& from, const State& to) const;
    State sampled(bool drawing = true) const;
    Expected<void> fill(const PackData& data, Transfer& transfer);
    // Calls copy(piece) for pieces of at most the staging buffer's size.
    Expected<void> forEachPiece(
        const std::function<Expected<void>(const VkBufferImageCopy&, size_t first_texel, size_t texels)>& copy) const;
    Expected<void> readArray(Transfer& transfer, VkImage image, std::vector<uint32_t>& texels) const;

    uint32_t width_ = 0, height_ = 0, layers_ = 0;
    // Where shaders of the queue's family sample: fragment shaders only where it draws.
    VkPipelineStageFlags sampling_stages_ = 0;
    PageArray irradiance_, direction_;
    SamplerHandle sampler_;
};

}  // namespace dimmer
