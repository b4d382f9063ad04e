#include "level_pipeline.h"

#include <dimmer/pack.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <spirv/level_frag.h>
#include <spirv/level_vert.h>
#include <spirv/model_frag.h>
#include <spirv/model_vert.h>
#include <spirv/sphere_frag.h>
#include <spirv/sphere_vert.h>

#include <cstddef>
#include <span>

namespace dimmer::sample {
namespace {

VkAttachmentDescription attachment(VkFormat format, VkSampleCountFlagBits samples, VkImageLayout final_layout) {
    VkAttachmentDescription description{};
    description.format = format;
    description.samples = samples;
    description.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
    description.storeOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
    description.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    description.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
    description.finalLayout = final_layout;
    return description;
}

Expected<ShaderModuleHandle> createShader(VkDevice device, std::span<const uint32_t> words) {
    auto info = vkStruct<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    info.codeSize = words.size_bytes();
    info.pCode = words.data();
    VkShaderModule module = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateShaderModule, device, &info, nullptr, &module);
    return ShaderModuleHandle(device, module);
}

VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits bit, VkShaderModule module) {
    auto info = vkStruct<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
    info.stage = bit;
    info.module = module;
    info.pName = "main";
    return info;
}

}  // namespace

Expected<RenderPassHandle> createLevelRenderPass(VkDevice device) {
    VkAttachmentDescription attachments[] = {
        attachment(radiance_format, sample_count, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL),
        attachment(depth_format, sample_count, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL),
        attachment(radiance_format, VK_SAMPLE_COUNT_1_BIT, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL)};
    attachments[2].loadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;  // the resolve writes every pixel
    attachments[2].storeOp = VK_ATTACHMENT_STORE_OP_STORE;

    const VkAttachmentReference color{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    const VkAttachmentReference depth{1, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL};
    const VkAttachmentReference resolve{2, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    VkSubpassDescription subpass{};
    subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
    subpass.colorAttachmentCount = 1;
    subpass.pColorAttachments = &color;
    subpass.pResolveAttachments = &resolve;
    subpass.pDepthStencilAttachment = &depth;

    constexpr VkPipelineStageFlags depth_stages =
        VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT;
    constexpr VkPipelineStageFlags write_stages = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT | depth_stages;
    constexpr VkAccessFlags writes =
        VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT;
    // Before: the last frame's writes and its copy. After: this frame's copy.
    const VkSubpassDependency dependencies[] = {
        {VK_SUBPASS_EXTERNAL, 0, write_stages | VK_PIPELINE_STAGE_TRANSFER_BIT, write_stages, writes,
         writes | VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT, 0},
        {0, VK_SUBPASS_EXTERNAL, VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT,
         VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT, VK_ACCESS_TRANSFER_READ_BIT, 0}};

    auto info = vkStruct<VkRenderPassCreateInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO);
    info.attachmentCount = std::size(attachments);
    info.pAttachments = attachments;
    info.subpassCount = 1;
    info.pSubpasses = &subpass;
    info.dependencyCount = std::size(dependencies);
    info.pDependencies = dependencies;
    VkRenderPass pass = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateRenderPass, device, &info, nullptr, &pass);
    return RenderPassHandle(device, pass);
}

namespace {

struct Shaders {
    std::span<const uint32_t> vertex, fragment;
};

// Opaque, back faces culled.
Expected<PipelineHandle> createPipeline(VkDevice device, const Shaders& shaders,
                                        const VkPipelineVertexInputStateCreateInfo& input, VkPipelineLayout layout,
                                        VkRenderPass render_pass, VkExtent2D extent) {
    const auto vertex = createShader(device, shaders.vertex);
    if (!vertex) return std::unexpected(vertex.error());
    const auto fragment = createShader(device, shaders.fragment);
    if (!fragment) return std::unexpected(fragment.error());
    const VkPipelineShaderStageCreateInfo stages[] = {stage(VK_SHADER_STAGE_VERTEX_BIT, vertex->get()),
                                                      stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment->get())};
    auto assembly =
        vkStruct<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
    assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;

    const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
    const VkRect2D scissor{{0, 0}, extent};
    auto view = vkStruct<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
    view.viewportCount = view.scissorCount = 1;
    view.pViewports = &viewport;
    view.pScissors = &scissor;

    auto raster =
        vkStruct<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
    raster.polygonMode = VK_POLYGON_MODE_FILL;
    raster.cullMode = VK_CULL_MODE_BACK_BIT;
    raster.frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE;
    raster.lineWidth = 1;
    auto samples =
        vkStruct<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
    samples.rasterizationSamples = sample_count;
    auto depth =
        vkStruct<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
    depth.depthTestEnable = depth.depthWriteEnable = VK_TRUE;
    depth.depthCompareOp = VK_COMPARE_OP_LESS;

    VkPipelineColorBlendAttachmentState opaque{};
    opaque.colorWriteMask = 0xf;
    auto blending =
        vkStruct<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
    blending.attachmentCount = 1;
    blending.pAttachments = &opaque;

    auto info = vkStruct<VkGraphicsPipelineCreateInfo>(VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO);
    info.stageCount = std::size(stages);
    info.pStages = stages;
    info.pVertexInputState = &input;
    info.pInputAssemblyState = &assembly;
    info.pViewportState = &view;
    info.pRasterizationState = &raster;
    info.pMultisampleState = &samples;
    info.pDepthStencilState = &depth;
    info.pColorBlendState = &blending;
    info.layout = layout;
    info.renderPass = render_pass;
    VkPipeline pipeline = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateGraphicsPipelines, device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
    return PipelineHandle(device, pipeline);
}

}  // namespace

Expected<PipelineHandle> createLevelPipeline(VkDevice device, VkPipelineLayout layout, VkRenderPass render_pass,
                                             VkExtent2D extent) {
    const VkVertexInputBindingDescription binding{0, sizeof(MeshVertex), VK_VERTEX_INPUT_RATE_VERTEX};
    const VkVertexInputAttributeDescription attributes[] = {
        {0, 0, VK_FORMAT_R32G32B32_SFLOAT, offsetof(MeshVertex, position_m)},
        {1, 0, VK_FORMAT_R32G32_SFLOAT, offsetof(MeshVertex, lightmap_uv)}};
    auto input =
        vkStruct<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
    input.vertexBindingDescriptionCount = 1;
    input.pVertexBindingDescriptions = &binding;
    input.vertexAttributeDescriptionCount = std::size(attributes);
    input.pVertexAttributeDescriptions = attributes;
    return createPipeline(device, {spirv::level_vert, spirv::level_frag}, input, layout, render_pass, extent);
}

Expected<PipelineHandle> createModelPipeline(VkDevice device, VkPipelineLayout layout, VkRenderPass render_pass,
                                             VkExtent2D extent) {
    const VkVertexInputBindingDescription binding{0, sizeof(ModelVertex), VK_VERTEX_INPUT_RATE_VERTEX};
    // Formats of three 16-bit numbers are optional in Vulkan, so the position's fourth is whatever follows it.
    const VkVertexInputAttributeDescription attributes[] = {
        {0, 0, VK_FORMAT_R16G16B16A16_UNORM, offsetof(ModelVertex, position)},
        {1, 0, VK_FORMAT_R16G16_SNORM, offsetof(ModelVertex, normal)},
        {2, 0, VK_FORMAT_R8G8B8A8_SNORM, offsetof(ModelVertex, transfer)},
        {3, 0, VK_FORMAT_R8G8B8A8_SNORM, offsetof(ModelVertex, transfer) + 4},
        {4, 0, VK_FORMAT_R8_SNORM, offsetof(ModelVertex, transfer) + 8}};
    auto input =
        vkStruct<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
    input.vertexBindingDescriptionCount = 1;
    input.pVertexBindingDescriptions = &binding;
    input.vertexAttributeDescriptionCount = std::size(attributes);
    input.pVertexAttributeDescriptions = attributes;
    return createPipeline(device, {spirv::model_vert, spirv::model_frag}, input, layout, render_pass, extent);
}

Expected<PipelineHandle> createSpherePipeline(VkDevice device, VkPipelineLayout layout, VkRenderPass render_pass,
                                              VkExtent2D extent) {
    const auto input =
        vkStruct<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
    return createPipeline(device, {spirv::sphere_vert, spirv::sphere_frag}, input, layout, render_pass, extent);
}

}  // namespace dimmer::sample
