#include <gpu/texel_blender.h>

#include <fmt/format.h>
#include <format/texel.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <spirv/blend_texels_comp.h>

#include <algorithm>
#include <cstring>

namespace dimmer {
namespace {

// The bindings of blend_texels.comp: buffers first, then the two page arrays.
constexpr uint32_t buffer_count = 5, image_count = 2, binding_count = buffer_count + image_count;

struct DispatchConstants {
    uint32_t first_item, item_count;
};

constexpr VkDescriptorType bindingType(uint32_t binding) {
    return binding < buffer_count ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
}

Expected<void> checkLimits(const VkPhysicalDeviceLimits& limits, const PackData& data, const Planner& planner) {
    const uint64_t payload_bytes = uint64_t{data.payload.size()} * sizeof(TexelRecord);
    const uint64_t base_bytes = uint64_t{data.addresses.size()} * sizeof(TexelRecord);
    const uint64_t work_bytes = 16ull * std::max(planner.itemsMax(), planner.termsMax());
    const uint64_t largest = std::max({payload_bytes, base_bytes, work_bytes});
    if (largest > limits.maxStorageBufferRange)
        return fail(ErrorCode::Unsupported,
                    fmt::format("The pack's dynamic light ({} bytes of records, {} bytes of base, {} bytes of work "
                                "list) exceeds what this Vulkan device binds as one storage buffer, {} bytes. Cook "
                                "with fewer texels per metre or a higher activity threshold.",
                                payload_bytes, base_bytes, work_bytes, limits.maxStorageBufferRange));
    if (limits.maxPerStageDescriptorStorageBuffers < buffer_count)
        return fail(ErrorCode::Unsupported, fmt::format("The Vulkan device binds {} storage buffers to a shader; {} "
                                                        "are needed.",
                                                        limits.maxPerStageDescriptorStorageBuffers, buffer_count));
    return {};
}

// What the base pages hold at the receivers, in their order, so that lanes read it side by side.
void gatherBase(const PackData& data, size_t first_receiver, std::span<TexelRecord> records) {
    for (size_t i = 0; i < records.size(); ++i) {
        const uint32_t address = data.addresses[first_receiver + i];
        const size_t row = size_t{TexelAddress::page(address)} * data.page_height + TexelAddress::y(address);
        const TexelRecord& base = data.base_pages[row * data.page_width + TexelAddress::x(address)];
        records[i] = {clampR11G11B10(base.irradiance), base.direction};
    }
}

template <class T>
std::function<void(VkDeviceSize, std::span<std::byte>)> copyOf(const std::vector<T>& values) {
    return [&values](VkDeviceSize offset, std::span<std::byte> piece) {
        std::memcpy(piece.data(), reinterpret_cast<const std::byte*>(values.data()) + offset, piece.size());
    };
}

Expected<GpuBuffer> createFilled(const VulkanContext& vulkan, Transfer& transfer, VkDeviceSize size_bytes,
                                 const std::function<void(VkDeviceSize, std::span<std::byte>)>& fill) {
    auto buffer = createBuffer(
        vulkan, size_bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Device);
    if (!buffer) return buffer;
    DIMMER_TRY(transfer.upload(buffer->buffer.get(), size_bytes, fill));
    return buffer;
}

Expected<ShaderModuleHandle> createModule(VkDevice device) {
    auto info = vkStruct<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    info.codeSize = sizeof(spirv::blend_texels_comp);
    info.pCode = spirv::blend_texels_comp;
    VkShaderModule module = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateShaderModule, device, &info, nullptr, &module);
    return ShaderModuleHandle(device, module);
}

}  // namespace

Expected<TexelBlender> TexelBlender::create(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                            const LightmapPages& pages, Transfer& transfer) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(vulkan.physical_device, &properties);
    DIMMER_TRY(checkLimits(properties.limits, data, planner));

    TexelBlender blender;
    blender.groups_x_max_ = properties.limits.maxComputeWorkGroupCount[0];
    DIMMER_TRY(blender.createBuffers(vulkan, data, planner, transfer));
    DIMMER_TRY(blender.createLayouts(vulkan.device));
    DIMMER_TRY(blender.createDescriptors(vulkan.device, pages));
    DIMMER_TRY(blender.createPipelines(vulkan.device, planner.overlapMax()));
    return blender;
}

Expected<void> TexelBlender::createBuffers(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                           Transfer& transfer) {
    auto keep = [](Expected<GpuBuffer> made, GpuBuffer& slot) -> Expected<void> {
        if (!made) return std::unexpected(std::move(made.error()));
        slot = std::move(*made);
        return {};
    };
    DIMMER_TRY(keep(createFilled(vulkan, transfer, data.addresses.size() * sizeof(uint32_t), copyOf(data.addresses)),
                    addresses_));
    DIMMER_TRY(keep(createFilled(vulkan, transfer, data.payload.size() * sizeof(TexelRecord), copyOf(data.payload)),
                    payload_));
    DIMMER_TRY(keep(createFilled(vulkan, transfer, data.addresses.size() * sizeof(TexelRecord),
                                 [&](VkDeviceSize offset, std::span<std::byte> piece) {
                                     auto* records = reinterpret_cast<TexelRecord*>(piece.data());
                                     gatherBase(data, offset / sizeof(TexelRecord),
                                                std::span(records, piece.size() / sizeof(TexelRecord)));
                                 }),
                    base_));
    DIMMER_TRY(keep(createBuffer(vulkan, planner.itemsMax() * sizeof(WorkItem), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                                 MemoryUse::Upload),
                    items_));
    return keep(createBuffer(vulkan, planner.termsMax() * sizeof(WorkTerm), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                             MemoryUse::Upload),
                terms_);
}

Expected<void> TexelBlender::createLayouts(VkDevice device) {
    std::array<VkDescriptorSetLayoutBinding, binding_count> bindings{};
    for (uint32_t i = 0; i < binding_count; ++i) {
        bindings[i].binding = i;
        bindings[i].descriptorType = bindingType(i);
        bindings[i].descriptorCount = 1;
        bindings[i].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
    }
    auto set_info = vkStruct<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    set_info.bindingCount = binding_count;
    set_info.pBindings = bindings.data();
    VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorSetLayout, device, &set_info, nullptr, &set_layout);
    set_layout_ = SetLayoutHandle(device, set_layout);

    const VkPushConstantRange constants{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(DispatchConstants)};
    auto info = vkStruct<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    info.setLayoutCount = 1;
    info.pSetLayouts = &set_layout;
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &constants;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreatePipelineLayout, device, &info, nullptr, &layout);
    pipeline_layout_ = PipelineLayoutHandle(device, layout);
    return {};
}

Expected<void> TexelBlender::createDescriptors(VkDevice device, const LightmapPages& pages) {
    const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, buffer_count},
                                          {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, image_count}};
    auto pool_info = vkStruct<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    pool_info.maxSets = 1;
    pool_info.poolSizeCount = 2;
    pool_info.pPoolSizes = sizes;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorPool, device, &pool_info, nullptr, &pool);
    descriptor_pool_ = DescriptorPoolHandle(device, pool);

    const VkDescriptorSetLayout set_layout = set_layout_.get();
    auto set_info = vkStruct<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    set_info.descriptorPool = pool;
    set_info.descriptorSetCount = 1;
    set_info.pSetLayouts = &set_layout;
    DIMMER_VK(vkAllocateDescriptorSets, device, &set_info, &descriptors_);

    const GpuBuffer* buffers[buffer_count] = {&addresses_, &base_, &payload_, &items_, &terms_};
    const VkImageView views[image_count] = {pages.irradianceStorageView(), pages.directionStorageView()};
    VkDescriptorBufferInfo buffer_infos[buffer_count];
    VkDescriptorImageInfo image_infos[image_count];
    std::array<VkWriteDescriptorSet, binding_count> writes;
    for (uint32_t i = 0; i < binding_count; ++i) {
        writes[i] = vkStruct<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
        writes[i].dstSet = descriptors_;
        writes[i].dstBinding = i;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = bindingType(i);
        if (i < buffer_count) {
            buffer_infos[i] = {buffers[i]->buffer.get(), 0, VK_WHOLE_SIZE};
            writes[i].pBufferInfo = &buffer_infos[i];
        } else {
            image_infos[i - buffer_count] = {VK_NULL_HANDLE, views[i - buffer_count], VK_IMAGE_LAYOUT_GENERAL};
            writes[i].pImageInfo = &image_infos[i - buffer_count];
        }
    }
    vkUpdateDescriptorSets(device, binding_count, writes.data(), 0, nullptr);
    return {};
}

Expected<void> TexelBlender::createPipelines(VkDevice device, uint32_t overlap_max) {
    const auto module = createModule(device);
    if (!module) return std::unexpected(module.error());
    // Groups that no cluster can reach get no pipeline.
    const uint32_t count = workGroupOf(overlap_max) + 1;
    std::array<int32_t, work_group_count> terms_on;
    std::array<VkSpecializationInfo, work_group_count> specialisations;
    std::array<VkComputePipelineCreateInfo, work_group_count> infos;
    const VkSpecializationMapEntry entry{0, 0, sizeof(int32_t)};
    for (uint32_t group = 0; group < count; ++group) {
        terms_on[group] = group <= specialised_terms_max ? static_cast<int32_t>(group) : -1;
        specialisations[group] = {1, &entry, sizeof(int32_t), &terms_on[group]};
        auto& info = infos[group];
        info = vkStruct<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
        info.stage = vkStruct<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
        info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
        info.stage.module = module->get();
        info.stage.pName = "main";
        info.stage.pSpecializationInfo = &specialisations[group];
        info.layout = pipeline_layout_.get();
        info.basePipelineIndex = -1;
    }
    std::array<VkPipeline, work_group_count> made{};
    const VkResult result = vkCreateComputePipelines(device, VK_NULL_HANDLE, count, infos.data(), nullptr, made.data());
    // Some may exist even when others failed.
    for (uint32_t group = 0; group < count; ++group) pipelines_[group] = PipelineHandle(device, made[group]);
    if (result < 0) return vulkanError(result, "vkCreateComputePipelines");
    return {};
}

void TexelBlender::write(const WorkList& work) {
    std::memcpy(items_.mapped, work.items.data(), work.items.size_bytes());
    // Everything may be off: an empty span's data is not for memcpy.
    if (!work.terms.empty()) std::memcpy(terms_.mapped, work.terms.data(), work.terms.size_bytes());
}

uint32_t TexelBlender::dispatch(VkCommandBuffer commands, const WorkList& work) const {
    uint32_t dispatches = 0;
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_layout_.get(), 0, 1, &descriptors_, 0,
                            nullptr);
    for (uint32_t i = 0; i < work_group_count; ++i) {
        const WorkGroup& group = work.groups[i];
        if (group.item_count == 0) continue;
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_[i].get());
        const DispatchConstants constants{group.first_item, group.item_count};
        vkCmdPushConstants(commands, pipeline_layout_.get(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(constants),
                           &constants);
        // In rows, as one side of the grid is limited (65535 on some devices); the kernel skips the last row's rest.
        const uint32_t columns = std::min(group.item_count, groups_x_max_);
        vkCmdDispatch(commands, columns, (group.item_count + columns - 1) / columns, 1);
        ++dispatches;
    }
    return dispatches;
}

}  // namespace dimmer
