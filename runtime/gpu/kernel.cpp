#include <gpu/kernel.h>

#include <fmt/format.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <update/device_places.h>

#include <algorithm>
#include <array>

namespace dimmer {
namespace {

constexpr std::array descriptor_types = {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
                                         VK_DESCRIPTOR_TYPE_STORAGE_IMAGE};

VkDescriptorType typeOf(const KernelBinding& binding) {
    return descriptor_types[static_cast<size_t>(binding.kind)];
}

// Of those formats that tables have.
VkDeviceSize texelBytes(VkFormat format) {
    switch (format) {
        case VK_FORMAT_R8G8_UINT:
        case VK_FORMAT_R16_UINT:
            return 2;
        case VK_FORMAT_R32_UINT:
            return 4;
        case VK_FORMAT_R32G32_UINT:
            return 8;
        default:
            return 16;
    }
}

Expected<void> checkTable(const VkPhysicalDeviceLimits& limits, VkDeviceSize size_bytes) {
    if (size_bytes <= limits.maxStorageBufferRange) return {};
    return fail(ErrorCode::Unsupported,
                fmt::format("A table of {} bytes exceeds what this Vulkan device reads as one buffer, {} texels "
                            "(maxTexelBufferElements) or {} bytes (maxStorageBufferRange). Cook with fewer texels per "
                            "metre, wider grids or a higher activity threshold, or create the runtime with a smaller "
                            "moving_probes_max.",
                            size_bytes, limits.maxTexelBufferElements, limits.maxStorageBufferRange));
}

// Of one set, in which tables are storage buffers.
Expected<void> checkStorageTables(const VulkanContext& vulkan, std::span<const KernelBinding> bindings) {
    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    for (const KernelBinding& binding : bindings) DIMMER_TRY(checkTable(limits, binding.table_bytes));
    const auto buffers = std::ranges::count(bindings, KernelBinding::Kind::StorageBuffer, &KernelBinding::kind);
    if (buffers <= limits.maxPerStageDescriptorStorageBuffers) return {};
    return fail(ErrorCode::Unsupported,
                fmt::format("The pack's tables have more than the {} texels that this Vulkan device reads as one "
                            "texel buffer; read otherwise they take {} storage buffers in a shader, and the device "
                            "binds {} (maxPerStageDescriptorStorageBuffers).",
                            limits.maxTexelBufferElements, buffers, limits.maxPerStageDescriptorStorageBuffers));
}

Expected<ShaderModuleHandle> createModule(VkDevice device, std::span<const uint32_t> spirv) {
    auto info = vkStruct<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    info.codeSize = spirv.size_bytes();
    info.pCode = spirv.data();
    VkShaderModule module = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateShaderModule, device, &info, nullptr, &module);
    return ShaderModuleHandle(device, module);
}

}  // namespace

Expected<Kernel> Kernel::create(const VulkanContext& vulkan, const KernelCode& code,
                                std::span<const KernelBinding> bindings, uint32_t push_constant_bytes,
                                std::span<const Specialisation> pipelines, uint32_t set_count) {
    std::vector<KernelBinding> bound(bindings.begin(), bindings.end());
    const bool by_storage = std::ranges::any_of(bound, [](const KernelBinding& binding) {
        return binding.kind == KernelBinding::Kind::TexelBuffer && !binding.texels;
    });
    if (by_storage) {
        for (KernelBinding& binding : bound)
            if (binding.kind == KernelBinding::Kind::TexelBuffer) binding.kind = KernelBinding::Kind::StorageBuffer;
        DIMMER_TRY(checkStorageTables(vulkan, std::span(bound).first(bound.size() / set_count)));
    }
    Kernel kernel;
    DIMMER_TRY(
        kernel.createLayouts(vulkan.device, std::span(bound).first(bound.size() / set_count), push_constant_bytes));
    DIMMER_TRY(kernel.createDescriptors(vulkan.device, bound, set_count));
    DIMMER_TRY(kernel.createPipelines(vulkan, by_storage ? code.storage_tables : code.texel_tables, pipelines));
    return kernel;
}

Expected<void> Kernel::createLayouts(VkDevice device, std::span<const KernelBinding> bindings,
                                     uint32_t push_constant_bytes) {
    std::vector<VkDescriptorSetLayoutBinding> layout_bindings;
    for (const KernelBinding& binding : bindings)
        layout_bindings.push_back(
            {static_cast<uint32_t>(layout_bindings.size()), typeOf(binding), 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    auto set_info = vkStruct<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    set_info.bindingCount = static_cast<uint32_t>(layout_bindings.size());
    set_info.pBindings = layout_bindings.data();
    VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorSetLayout, device, &set_info, nullptr, &set_layout);
    set_layout_ = SetLayoutHandle(device, set_layout);

    const VkPushConstantRange constants{VK_SHADER_STAGE_COMPUTE_BIT, 0, push_constant_bytes};
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

Expected<void> Kernel::createDescriptors(VkDevice device, std::span<const KernelBinding> bindings, uint32_t set_count) {
    std::vector<VkDescriptorPoolSize> sizes;
    for (VkDescriptorType type : descriptor_types)
        if (const auto n = std::ranges::count(bindings, type, typeOf))
            sizes.push_back({type, static_cast<uint32_t>(n)});
    auto pool_info = vkStruct<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    pool_info.maxSets = set_count;
    pool_info.poolSizeCount = static_cast<uint32_t>(sizes.size());
    pool_info.pPoolSizes = sizes.data();
    VkDescriptorPool pool = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateDescriptorPool, device, &pool_info, nullptr, &pool);
    descriptor_pool_ = DescriptorPoolHandle(device, pool);
    const size_t set_size = bindings.size() / set_count;
    for (uint32_t i = 0; i < set_count; ++i) {
        const auto set = createSet(device, bindings.subspan(i * set_size, set_size));
        if (!set) return std::unexpected(set.error());
        descriptors_.push_back(*set);
    }
    return {};
}

Expected<VkDescriptorSet> Kernel::createSet(VkDevice device, std::span<const KernelBinding> bindings) const {
    const VkDescriptorSetLayout set_layout = set_layout_.get();
    auto set_info = vkStruct<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    set_info.descriptorPool = descriptor_pool_.get();
    set_info.descriptorSetCount = 1;
    set_info.pSetLayouts = &set_layout;
    VkDescriptorSet set = VK_NULL_HANDLE;
    DIMMER_VK(vkAllocateDescriptorSets, device, &set_info, &set);

    for (uint32_t i = 0; i < bindings.size(); ++i) {
        const VkDescriptorBufferInfo buffer{bindings[i].buffer, 0, VK_WHOLE_SIZE};
        const VkDescriptorImageInfo image{VK_NULL_HANDLE, bindings[i].image, VK_IMAGE_LAYOUT_GENERAL};
        auto write = vkStruct<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
        write.dstSet = set;
        write.dstBinding = i;
        write.descriptorCount = 1;
        write.descriptorType = typeOf(bindings[i]);
        write.pTexelBufferView = &bindings[i].texels;
        write.pBufferInfo = &buffer;
        write.pImageInfo = &image;
        vkUpdateDescriptorSets(device, 1, &write, 0, nullptr);
    }
    return set;
}

Expected<void> Kernel::createPipelines(const VulkanContext& vulkan, std::span<const uint32_t> spirv,
                                       std::span<const Specialisation> specialisations) {
    const auto module = createModule(vulkan.device, spirv);
    if (!module) return std::unexpected(module.error());
    constexpr uint32_t word = sizeof(uint32_t);
    std::vector<std::vector<VkSpecializationMapEntry>> entries(specialisations.size());
    std::vector<VkSpecializationInfo> constants(specialisations.size());
    std::vector<VkComputePipelineCreateInfo> infos(specialisations.size());
    for (size_t i = 0; i < specialisations.size(); ++i) {
        const Specialisation& values = specialisations[i];
        for (uint32_t id = 0; id < values.size(); ++id) entries[i].push_back({id, id * word, word});
        constants[i] = {static_cast<uint32_t>(values.size()), entries[i].data(), values.size() * word, values.data()};
        auto& info = infos[i];
        info = vkStruct<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
        info.stage = vkStruct<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
        info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
        info.stage.module = module->get();
        info.stage.pName = "main";
        info.stage.pSpecializationInfo = &constants[i];
        info.layout = pipeline_layout_.get();
        info.basePipelineIndex = -1;
    }
    std::vector<VkPipeline> made(specialisations.size(), VK_NULL_HANDLE);
    const VkResult result = vkCreateComputePipelines(
        vulkan.device, vulkan.pipeline_cache, static_cast<uint32_t>(infos.size()), infos.data(), nullptr, made.data());
    // Some may exist even when others failed.
    for (VkPipeline pipeline : made) pipelines_.emplace_back(vulkan.device, pipeline);
    if (result < 0) return vulkanError(result, "vkCreateComputePipelines");
    return {};
}

void Kernel::bind(VkCommandBuffer commands, size_t pipeline, uint32_t set) const {
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_layout_.get(), 0, 1, &descriptors_[set],
                            0, nullptr);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_[pipeline].get());
}

Expected<GpuTable> createTable(const VulkanContext& vulkan, VkDeviceSize size_bytes, VkFormat format, MemoryUse use) {
    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    const bool as_texels = size_bytes / texelBytes(format) <= limits.maxTexelBufferElements;
    if (!as_texels) DIMMER_TRY(checkTable(limits, size_bytes));
    GpuTable result;
    // Of a kernel's tables, those that would do as texels become storage buffers with the one that does not.
    auto buffer = createBuffer(vulkan, std::max<VkDeviceSize>(size_bytes, texel_buffer_bytes_min),
                               VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT |
                                   VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                               use);
    if (!buffer) return std::unexpected(std::move(buffer.error()));
    result.buffer = std::move(*buffer);
    if (!as_texels) return result;
    auto info = vkStruct<VkBufferViewCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO);
    info.buffer = result.buffer.buffer.get();
    info.format = format;
    info.range = VK_WHOLE_SIZE;
    VkBufferView view = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateBufferView, vulkan.device, &info, nullptr, &view);
    result.view = BufferViewHandle(vulkan.device, view);
    return result;
}

}  // namespace dimmer
