#include "storage_bindings.h"

#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

namespace dimmer::sample {

Expected<StorageBindings> StorageBindings::create(VkDevice device, const std::array<VkBuffer, 2>& buffers,
                                                  VkShaderStageFlags stages, uint32_t constants_bytes) {
    StorageBindings made;
    made.stages_ = stages;
    made.constants_bytes_ = constants_bytes;
    VkDescriptorSetLayoutBinding bindings[2]{};
    for (uint32_t i = 0; i < 2; ++i) bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, stages, nullptr};
    auto set_info = vkStruct<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    set_info.bindingCount = std::size(bindings);
    set_info.pBindings = bindings;
    VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorSetLayout, device, &set_info, nullptr, &set_layout);
    made.set_layout_ = {device, set_layout};

    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2};
    auto pool_info = vkStruct<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    pool_info.maxSets = 1;
    pool_info.poolSizeCount = 1;
    pool_info.pPoolSizes = &size;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorPool, device, &pool_info, nullptr, &pool);
    made.pool_ = {device, pool};

    auto allocate = vkStruct<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    allocate.descriptorPool = pool;
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &set_layout;
    DIMMER_VK(vkAllocateDescriptorSets, device, &allocate, &made.set_);

    const VkDescriptorBufferInfo infos[] = {{buffers[0], 0, VK_WHOLE_SIZE}, {buffers[1], 0, VK_WHOLE_SIZE}};
    auto write = vkStruct<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    write.dstSet = made.set_;
    write.descriptorCount = std::size(infos);  // runs on from binding 0 to binding 1
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = infos;
    vkUpdateDescriptorSets(device, 1, &write, 0, nullptr);

    const VkPushConstantRange range{stages, 0, constants_bytes};
    auto info = vkStruct<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    info.setLayoutCount = 1;
    info.pSetLayouts = &set_layout;
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &range;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreatePipelineLayout, device, &info, nullptr, &layout);
    made.layout_ = {device, layout};
    return made;
}

void StorageBindings::bind(VkCommandBuffer commands, const void* constants) const {
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_.get(), 0, 1, &set_, 0, nullptr);
    vkCmdPushConstants(commands, layout_.get(), stages_, 0, constants_bytes_, constants);
}

}  // namespace dimmer::sample
