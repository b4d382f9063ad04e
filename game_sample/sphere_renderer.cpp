#include "sphere_renderer.h"

#include "level_pipeline.h"
#include "shaders/draw_constants.glsl"

#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <cstring>

namespace dimmer::sample {
namespace {

constexpr uint32_t sphere_vertices = 24 * 12 * 6;  // columns, rows and corners of sphere.vert
constexpr VkShaderStageFlags stages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;

}  // namespace

std::vector<Sphere> probeSpheres(const Pack& pack, float radius_m) {
    std::vector<Sphere> spheres;
    for (const ProbePosition& p : pack.data().probes.global.positions) {
        const auto number = static_cast<uint32_t>(spheres.size());
        spheres.push_back({{p.x_m, p.y_m, p.z_m}, radius_m, glm::vec4(0.8f), {number, {1, 1, 1}, {}}});
    }
    return spheres;
}

Expected<SphereRenderer> SphereRenderer::create(const VulkanContext& vulkan, const Runtime& lights,
                                                VkRenderPass render_pass, VkExtent2D extent, uint32_t spheres_max) {
    SphereRenderer renderer;
    renderer.exposure_ = lights.pack().exposure();
    renderer.color_format_ = static_cast<uint32_t>(lights.pack().colorFormat());
    auto spheres =
        createBuffer(vulkan, spheres_max * sizeof(Sphere), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Upload);
    if (!spheres) return std::unexpected(spheres.error());
    renderer.spheres_ = std::move(*spheres);
    DIMMER_TRY(renderer.createDescriptors(vulkan, lights.probes(0)));
    DIMMER_TRY(renderer.createLayout(vulkan.device));
    auto pipeline = createSpherePipeline(vulkan.device, renderer.layout_.get(), render_pass, extent);
    if (!pipeline) return std::unexpected(pipeline.error());
    renderer.pipeline_ = std::move(*pipeline);
    return renderer;
}

Expected<void> SphereRenderer::createDescriptors(const VulkanContext& vulkan, VkBuffer probes) {
    VkDescriptorSetLayoutBinding bindings[2]{};
    for (uint32_t i = 0; i < 2; ++i) bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, stages, nullptr};
    auto layout = vkStruct<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    layout.bindingCount = std::size(bindings);
    layout.pBindings = bindings;
    VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorSetLayout, vulkan.device, &layout, nullptr, &set_layout);
    set_layout_ = {vulkan.device, set_layout};

    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2};
    auto pool_info = vkStruct<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    pool_info.maxSets = 1;
    pool_info.poolSizeCount = 1;
    pool_info.pPoolSizes = &size;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorPool, vulkan.device, &pool_info, nullptr, &pool);
    descriptor_pool_ = {vulkan.device, pool};

    auto allocate = vkStruct<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    allocate.descriptorPool = pool;
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &set_layout;
    DIMMER_VK(vkAllocateDescriptorSets, vulkan.device, &allocate, &descriptors_);

    const VkDescriptorBufferInfo infos[] = {{probes, 0, VK_WHOLE_SIZE}, {spheres_.buffer.get(), 0, VK_WHOLE_SIZE}};
    auto write = vkStruct<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    write.dstSet = descriptors_;
    write.descriptorCount = std::size(infos);  // runs on from binding 0 to binding 1
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = infos;
    vkUpdateDescriptorSets(vulkan.device, 1, &write, 0, nullptr);
    return {};
}

Expected<void> SphereRenderer::createLayout(VkDevice device) {
    const VkDescriptorSetLayout set_layout = set_layout_.get();
    const VkPushConstantRange range{stages, 0, sizeof(SphereConstants)};
    auto info = vkStruct<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    info.setLayoutCount = 1;
    info.pSetLayouts = &set_layout;
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &range;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreatePipelineLayout, device, &info, nullptr, &layout);
    layout_ = {device, layout};
    return {};
}

void SphereRenderer::draw(VkCommandBuffer commands, const glm::mat4& clip_from_world,
                          std::span<const Sphere> spheres) const {
    const size_t count = std::min<size_t>(spheres.size(), spheres_.size_bytes / sizeof(Sphere));
    if (count == 0) return;
    std::memcpy(spheres_.mapped, spheres.data(), count * sizeof(Sphere));
    const SphereConstants constants{clip_from_world, exposure_, color_format_};
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.get());
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_.get(), 0, 1, &descriptors_, 0, nullptr);
    vkCmdPushConstants(commands, layout_.get(), stages, 0, sizeof(constants), &constants);
    vkCmdDraw(commands, sphere_vertices, static_cast<uint32_t>(count), 0, 0);
}

}  // namespace dimmer::sample
