#include "level_renderer.h"

#include "shaders/draw_constants.glsl"

#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

namespace dimmer::sample {
namespace {

constexpr size_t bytes_per_pixel = 4 * sizeof(uint16_t);

glm::vec3 emission(const Mesh& mesh, const LightState& lights) {
    const glm::vec3 radiance = toVec3(mesh.emission_cd_m2);
    if (!mesh.emission_set) return radiance;
    const Weight weight = lights.weight(LightSet{*mesh.emission_set});
    return radiance * glm::vec3(weight.r, weight.g, weight.b);
}

Expected<RenderImage> createRenderImage(const VulkanContext& vulkan, VkExtent2D extent, VkFormat format,
                                        VkSampleCountFlagBits samples, VkImageUsageFlags usage,
                                        VkImageAspectFlags aspect) {
    auto info = vkStruct<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {extent.width, extent.height, 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = samples;
    info.usage = usage;
    auto image = createImage(vulkan, info);
    if (!image) return std::unexpected(image.error());

    auto view_info = vkStruct<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
    view_info.image = image->image.get();
    view_info.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view_info.format = format;
    view_info.subresourceRange = {aspect, 0, 1, 0, 1};
    VkImageView view = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateImageView, vulkan.device, &view_info, nullptr, &view);
    return RenderImage{std::move(*image), {vulkan.device, view}};
}

}  // namespace

Expected<LevelRenderer> LevelRenderer::create(const VulkanContext& vulkan, const Pack& pack,
                                              const LightmapImages& images, VkExtent2D extent) {
    LevelRenderer renderer(vulkan, pack, extent);
    DIMMER_TRY(renderer.createGeometry());
    DIMMER_TRY(renderer.createTargets());
    DIMMER_TRY(renderer.createRenderPass());
    DIMMER_TRY(renderer.createDescriptors(images));
    DIMMER_TRY(renderer.createPipeline());
    return renderer;
}

// All meshes in one vertex and one index buffer. They stay in memory that the host sees: a level is a few megabytes,
// and the sample is no benchmark of drawing.
Expected<void> LevelRenderer::createGeometry() {
    size_t vertex_count = 0, index_count = 0;
    for (const Mesh& mesh : pack_.meshes()) {
        draws_.push_back({static_cast<uint32_t>(index_count), static_cast<uint32_t>(mesh.indices.size()),
                          static_cast<int32_t>(vertex_count)});
        vertex_count += mesh.vertices.size();
        index_count += mesh.indices.size();
    }
    if (index_count == 0) return fail(ErrorCode::BadInput, "The pack has no mesh to draw.");
    if (vertex_count > INT32_MAX || index_count > UINT32_MAX)
        return fail(ErrorCode::BadInput, "The pack's meshes exceed the 2^31 vertices that one vertex buffer holds.");

    auto vertices =
        createBuffer(vulkan_, vertex_count * sizeof(MeshVertex), VK_BUFFER_USAGE_VERTEX_BUFFER_BIT, MemoryUse::Upload);
    if (!vertices) return std::unexpected(vertices.error());
    auto indices =
        createBuffer(vulkan_, index_count * sizeof(uint32_t), VK_BUFFER_USAGE_INDEX_BUFFER_BIT, MemoryUse::Upload);
    if (!indices) return std::unexpected(indices.error());
    vertices_ = std::move(*vertices);
    indices_ = std::move(*indices);

    auto* vertex_out = reinterpret_cast<MeshVertex*>(vertices_.mapped);
    auto* index_out = reinterpret_cast<uint32_t*>(indices_.mapped);
    for (const Mesh& mesh : pack_.meshes()) {
        vertex_out = std::copy(mesh.vertices.begin(), mesh.vertices.end(), vertex_out);
        index_out = std::copy(mesh.indices.begin(), mesh.indices.end(), index_out);
    }
    return {};
}

Expected<void> LevelRenderer::createTargets() {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(vulkan_.physical_device, &properties);
    const uint32_t largest = std::min(properties.limits.maxFramebufferWidth, properties.limits.maxFramebufferHeight);
    if (extent_.width > largest || extent_.height > largest)
        return fail(ErrorCode::InvalidArgument, "The picture is larger than the device can draw.");

    auto color = createRenderImage(vulkan_, extent_, radiance_format, sample_count, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT,
                                   VK_IMAGE_ASPECT_COLOR_BIT);
    if (!color) return std::unexpected(color.error());
    auto depth = createRenderImage(vulkan_, extent_, depth_format, sample_count,
                                   VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, VK_IMAGE_ASPECT_DEPTH_BIT);
    if (!depth) return std::unexpected(depth.error());
    auto resolved = createRenderImage(vulkan_, extent_, radiance_format, VK_SAMPLE_COUNT_1_BIT,
                                      VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                                      VK_IMAGE_ASPECT_COLOR_BIT);
    if (!resolved) return std::unexpected(resolved.error());
    auto readback = createBuffer(vulkan_, size_t(extent_.width) * extent_.height * bytes_per_pixel,
                                 VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback);
    if (!readback) return std::unexpected(readback.error());
    multisampled_ = std::move(*color);
    depth_ = std::move(*depth);
    resolved_ = std::move(*resolved);
    readback_ = std::move(*readback);
    return {};
}

Expected<void> LevelRenderer::createRenderPass() {
    auto pass = createLevelRenderPass(vulkan_.device);
    if (!pass) return std::unexpected(pass.error());
    render_pass_ = std::move(*pass);

    const VkImageView attachments[] = {multisampled_.view.get(), depth_.view.get(), resolved_.view.get()};
    auto info = vkStruct<VkFramebufferCreateInfo>(VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO);
    info.renderPass = render_pass_.get();
    info.attachmentCount = std::size(attachments);
    info.pAttachments = attachments;
    info.width = extent_.width;
    info.height = extent_.height;
    info.layers = 1;
    VkFramebuffer created_framebuffer = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateFramebuffer, vulkan_.device, &info, nullptr, &created_framebuffer);
    framebuffer_ = {vulkan_.device, created_framebuffer};
    return {};
}

Expected<void> LevelRenderer::createDescriptors(const LightmapImages& images) {
    VkDescriptorSetLayoutBinding bindings[2]{};
    for (uint32_t i = 0; i < 2; ++i)
        bindings[i] = {i, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, VK_SHADER_STAGE_FRAGMENT_BIT, nullptr};
    auto layout = vkStruct<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    layout.bindingCount = std::size(bindings);
    layout.pBindings = bindings;
    VkDescriptorSetLayout created_set_layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorSetLayout, vulkan_.device, &layout, nullptr, &created_set_layout);
    set_layout_ = {vulkan_.device, created_set_layout};

    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 2};
    auto pool = vkStruct<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    pool.maxSets = 1;
    pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    VkDescriptorPool created_descriptor_pool = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorPool, vulkan_.device, &pool, nullptr, &created_descriptor_pool);
    descriptor_pool_ = {vulkan_.device, created_descriptor_pool};

    const VkDescriptorSetLayout set_layout = set_layout_.get();
    auto allocate = vkStruct<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    allocate.descriptorPool = descriptor_pool_.get();
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &set_layout;
    DIMMER_VK(vkAllocateDescriptorSets, vulkan_.device, &allocate, &descriptors_);

    const VkDescriptorImageInfo infos[] = {
        {images.sampler, images.irradiance_view, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL},
        {images.sampler, images.direction_view, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL}};
    auto write = vkStruct<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    write.dstSet = descriptors_;
    write.descriptorCount = std::size(infos);  // runs on from binding 0 to binding 1
    write.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    write.pImageInfo = infos;
    vkUpdateDescriptorSets(vulkan_.device, 1, &write, 0, nullptr);
    return {};
}

Expected<void> LevelRenderer::createPipeline() {
    const VkDescriptorSetLayout set_layout = set_layout_.get();
    const VkPushConstantRange range{VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT, 0,
                                    sizeof(DrawConstants)};
    auto layout = vkStruct<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    layout.setLayoutCount = 1;
    layout.pSetLayouts = &set_layout;
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &range;
    VkPipelineLayout created_pipeline_layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreatePipelineLayout, vulkan_.device, &layout, nullptr, &created_pipeline_layout);
    pipeline_layout_ = {vulkan_.device, created_pipeline_layout};

    auto pipeline = createLevelPipeline(vulkan_.device, pipeline_layout_.get(), render_pass_.get(), extent_);
    if (!pipeline) return std::unexpected(pipeline.error());
    pipeline_ = std::move(*pipeline);
    return {};
}

void LevelRenderer::record(VkCommandBuffer commands, const CameraPose& camera, const glm::vec3& sky_cd_m2,
                           const LightState& lights, const DrawMore& also) const {
    VkClearValue clear[2]{};
    clear[0].color = {{sky_cd_m2.r, sky_cd_m2.g, sky_cd_m2.b, 1}};
    clear[1].depthStencil = {1, 0};
    auto begin = vkStruct<VkRenderPassBeginInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO);
    begin.renderPass = render_pass_.get();
    begin.framebuffer = framebuffer_.get();
    begin.renderArea.extent = extent_;
    begin.clearValueCount = std::size(clear);
    begin.pClearValues = clear;
    vkCmdBeginRenderPass(commands, &begin, VK_SUBPASS_CONTENTS_INLINE);
    const glm::mat4 clip_from_world =
        clipFromWorld(camera, static_cast<float>(extent_.width) / static_cast<float>(extent_.height));
    recordMeshes(commands, clip_from_world, lights);
    if (also) also(commands, clip_from_world);
    vkCmdEndRenderPass(commands);
    recordReadback(commands);
}

void LevelRenderer::recordMeshes(VkCommandBuffer commands, const glm::mat4& clip_from_world,
                                 const LightState& lights) const {
    const VkBuffer vertices = vertices_.buffer.get();
    const VkDeviceSize offset = 0;
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.get());
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_layout_.get(), 0, 1, &descriptors_, 0,
                            nullptr);
    vkCmdBindVertexBuffers(commands, 0, 1, &vertices, &offset);
    vkCmdBindIndexBuffer(commands, indices_.buffer.get(), 0, VK_INDEX_TYPE_UINT32);

    DrawConstants constants{};
    constants.exposure = pack_.exposure();
    constants.direction_model = static_cast<uint32_t>(pack_.directionModel());
    for (size_t i = 0; i < draws_.size(); ++i) {
        const Mesh& mesh = pack_.meshes()[i];
        constants.clip_from_world = glm::translate(clip_from_world, leaves_.offset(i, lights));
        constants.reflectance = toVec3(mesh.reflectance);
        constants.page = static_cast<float>(mesh.page);
        constants.emission_cd_m2 = emission(mesh, lights);
        vkCmdPushConstants(commands, pipeline_layout_.get(), VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT,
                           0, sizeof(constants), &constants);
        vkCmdDrawIndexed(commands, draws_[i].index_count, 1, draws_[i].first_index, draws_[i].vertex_offset, 0);
    }
}

void LevelRenderer::recordReadback(VkCommandBuffer commands) const {
    VkBufferImageCopy copy{};
    copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    copy.imageExtent = {extent_.width, extent_.height, 1};
    vkCmdCopyImageToBuffer(commands, resolved_.image.image.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                           readback_.buffer.get(), 1, &copy);

    auto barrier = vkStruct<VkBufferMemoryBarrier>(VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER);
    barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.buffer = readback_.buffer.get();
    barrier.size = VK_WHOLE_SIZE;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 0, nullptr, 1,
                         &barrier, 0, nullptr);
}

RadianceFrame LevelRenderer::read() const {
    RadianceFrame frame{extent_.width, extent_.height, {}};
    const auto* pixels = reinterpret_cast<const uint16_t*>(readback_.mapped);
    frame.rgba.assign(pixels, pixels + size_t(extent_.width) * extent_.height * 4);
    return frame;
}

}  // namespace dimmer::sample
