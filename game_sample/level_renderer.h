// Draws a pack's meshes with the runtime's lightmap into an offscreen image of radiance, and reads it back.
#pragma once

#include "camera.h"
#include "leaf_motion.h"
#include "level_pipeline.h"

#include <dimmer/runtime.h>
#include <gpu/memory.h>

#include <functional>
#include <span>
#include <vector>

namespace dimmer::sample {

// A frame as the host sees it: rows from the top, radiance in cd/m2, linear Rec.709, RGBA as 16-bit floats.
struct RadianceFrame {
    uint32_t width = 0, height = 0;
    std::vector<uint16_t> rgba;
};

struct RenderImage {
    GpuImage image;
    ImageViewHandle view;
};

class LevelRenderer {
   public:
    // `vulkan`'s queue must draw. `images` are the runtime's and must stay; `vulkan` outlives the renderer.
    static Expected<LevelRenderer> create(const VulkanContext& vulkan, const Pack& pack, const LightmapImages& images,
                                          VkExtent2D extent);

    // After the runtime's own recording, in the same command buffer. `sky_cd_m2` is seen where there is no mesh.
    // `also` draws what else there is in the same pass.
    using DrawMore = std::function<void(VkCommandBuffer commands, const glm::mat4& clip_from_world)>;
    void record(VkCommandBuffer commands, const CameraPose& camera, const glm::vec3& sky_cd_m2,
                const LightState& lights, const DrawMore& also = {}) const;
    VkRenderPass renderPass() const { return render_pass_.get(); }

    // The frame, once the commands have completed on the GPU.
    RadianceFrame read() const;

   private:
    struct Draw {
        uint32_t first_index = 0, index_count = 0;
        int32_t vertex_offset = 0;
    };

    LevelRenderer(const VulkanContext& vulkan, const Pack& pack, VkExtent2D extent)
        : vulkan_(vulkan), pack_(pack), leaves_(pack), extent_(extent) {}
    Expected<void> createGeometry();
    Expected<void> createTargets();
    Expected<void> createRenderPass();
    Expected<void> createDescriptors(const LightmapImages& images);
    Expected<void> createPipeline();
    void recordMeshes(VkCommandBuffer commands, const glm::mat4& clip_from_world, const LightState& lights) const;
    void recordReadback(VkCommandBuffer commands) const;

    VulkanContext vulkan_;
    Pack pack_;
    LeafMotion leaves_;
    VkExtent2D extent_;
    std::vector<Draw> draws_;  // one per mesh of the pack
    GpuBuffer vertices_, indices_, readback_;
    RenderImage multisampled_, depth_, resolved_;
    RenderPassHandle render_pass_;
    FramebufferHandle framebuffer_;
    SetLayoutHandle set_layout_;
    DescriptorPoolHandle descriptor_pool_;
    VkDescriptorSet descriptors_ = VK_NULL_HANDLE;
    PipelineLayoutHandle pipeline_layout_;
    PipelineHandle pipeline_;
};

}  // namespace dimmer::sample
