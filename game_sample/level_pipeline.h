// The fixed parts of drawing a level: formats, render pass, graphics pipeline.
#pragma once

#include <dimmer/error.h>
#include <gpu/vk_handle.h>

namespace dimmer::sample {

using RenderPassHandle = DeviceHandle<VkRenderPass, vkDestroyRenderPass>;
using FramebufferHandle = DeviceHandle<VkFramebuffer, vkDestroyFramebuffer>;

// What Vulkan promises everywhere, but for the depth: 32-bit floats are what desktop devices have in common.
inline constexpr VkFormat radiance_format = VK_FORMAT_R16G16B16A16_SFLOAT;
inline constexpr VkFormat depth_format = VK_FORMAT_D32_SFLOAT;
inline constexpr VkSampleCountFlagBits sample_count = VK_SAMPLE_COUNT_4_BIT;

// Attachments: multisampled radiance, depth, resolved radiance (left in TRANSFER_SRC_OPTIMAL).
Expected<RenderPassHandle> createLevelRenderPass(VkDevice device);

// Opaque, back faces culled, vertices as dimmer::MeshVertex, push constants as DrawConstants.
Expected<PipelineHandle> createLevelPipeline(VkDevice device, VkPipelineLayout layout, VkRenderPass render_pass,
                                             VkExtent2D extent);
// The same with vertices as dimmer::ModelVertex, push constants as ModelConstants.
Expected<PipelineHandle> createModelPipeline(VkDevice device, VkPipelineLayout layout, VkRenderPass render_pass,
                                             VkExtent2D extent);
// The same without vertex buffers, push constants as SphereConstants.
Expected<PipelineHandle> createSpherePipeline(VkDevice device, VkPipelineLayout layout, VkRenderPass render_pass,
                                              VkExtent2D extent);

}  // namespace dimmer::sample
