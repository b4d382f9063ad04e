// Devices that have less than this machine's: a loader of the tests' own takes it away, between the runtime and Vulkan.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gpu/kernel.h>

#include "gpu_fixture.h"
#include "model_pack.h"
#include "pages.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer {
namespace {

using test::packOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Functions that stand in for the loader's of that name.
struct Replaced {
    std::string_view name;
    PFN_vkVoidFunction function;
};
template <class Function>
Replaced replaced(std::string_view name, Function* function) {
    return {name, reinterpret_cast<PFN_vkVoidFunction>(function)};
}
PFN_vkVoidFunction oneOf(std::initializer_list<Replaced> functions, VkInstance instance, std::string_view name) {
    for (const Replaced& replacement : functions)
        if (replacement.name == name) return replacement.function;
    return vkGetInstanceProcAddr(instance, name.data());
}

// Limits below those of Vulkan's own, so that small packs exceed them.
struct Limits {
    uint32_t texels = UINT32_MAX, storage_bytes = UINT32_MAX, storage_buffers = UINT32_MAX;
};
template <Limits limits>
VKAPI_ATTR void VKAPI_CALL limitedProperties(VkPhysicalDevice device, VkPhysicalDeviceProperties* properties) {
    ::vkGetPhysicalDeviceProperties(device, properties);
    VkPhysicalDeviceLimits& has = properties->limits;
    has.maxTexelBufferElements = std::min(has.maxTexelBufferElements, limits.texels);
    has.maxStorageBufferRange = std::min(has.maxStorageBufferRange, limits.storage_bytes);
    has.maxPerStageDescriptorStorageBuffers = std::min(has.maxPerStageDescriptorStorageBuffers, limits.storage_buffers);
}
template <Limits limits>
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL limitedLoader(VkInstance instance, const char* name) {
    return oneOf({replaced("vkGetPhysicalDeviceProperties", limitedProperties<limits>)}, instance, name);
}

class GpuFewTexels : public test::GpuTest {
   protected:
    static void SetUpTestSuite() { createDevice(limitedLoader<Limits{.texels = 3}>); }

    static void expectEqual(Runtime& gpu, const CpuRuntime& cpu) {
        const auto pages = gpu.readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        ASSERT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages()));
        ASSERT_TRUE(std::ranges::equal(pages->direction, cpu.directionPages()));
        ASSERT_TRUE(std::ranges::equal(pages->probes, cpu.probes()));
    }
};

TEST_F(GpuFewTexels, LongerTablesHaveNoView) {
    const std::pair<VkFormat, VkDeviceSize> texel_bytes[] = {{VK_FORMAT_R8G8_UINT, 2},
                                                             {VK_FORMAT_R16_UINT, 2},
                                                             {VK_FORMAT_R32_UINT, 4},
                                                             {VK_FORMAT_R32G32_UINT, 8},
                                                             {VK_FORMAT_R32G32B32A32_UINT, 16}};
    for (const auto& [format, bytes] : texel_bytes) {
        EXPECT_TRUE(test::valueOf(createTable(device().context(), 3 * bytes, format, MemoryUse::Device)).view.get());
        const GpuTable longer = test::valueOf(createTable(device().context(), 4 * bytes, format, MemoryUse::Device));
        EXPECT_FALSE(longer.view.get()) << format;
        EXPECT_TRUE(longer.buffer.buffer.get()) << format;
    }
}

// Every kernel for texels, with clusters of odd sizes; and those for probes.
TEST_F(GpuFewTexels, PagesAndProbesAreThoseOfTheCpuToTheBit) {
    for (const ColorFormat format : {ColorFormat::R11G11B10F, ColorFormat::E5B9G9R9})
        for (const UpdateMode mode :
             {UpdateMode::WorkList, UpdateMode::PerCombination, UpdateMode::Gather, UpdateMode::Scatter}) {
            test::Random random(31);
            PackData data = test::randomPack(
                31,
                {.sets = 18, .doors = 2, .clusters = 60, .overlap_max = 20, .page_side = 80, .color_format = format});
            test::addRandomProbes(data, random);
            const Pack pack = packOf(std::move(data));
            const bool compares = mode == UpdateMode::Gather || mode == UpdateMode::Scatter;
            Runtime gpu = runtimeOf(pack, {.mode = mode,
                                           .buffering = compares ? Buffering::InPlace : Buffering::Double,
                                           .frames_in_flight = compares ? 1u : 2u});
            CpuRuntime cpu(pack);
            for (int step = 0; step < 6; ++step) {
                ASSERT_TRUE(gpu.submit());
                cpu.update();
                expectEqual(gpu, cpu);
                if (HasFailure()) FAIL() << "mode " << static_cast<int>(mode) << " step " << step;
                const std::string state = test::randomState(pack.data(), random);
                ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
            }
        }
}

TEST_F(GpuFewTexels, RecordsThatComeAndGoToo) {
    const Pack pack = packOf(test::randomPack(32, {.doors = 0}));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    const LightSet set{0};
    ASSERT_TRUE(gpu.dropRecords(set));
    ASSERT_TRUE(cpu.setWeight(set, 0));
    ASSERT_TRUE(gpu.submit());
    cpu.update();
    expectEqual(gpu, cpu);
    ASSERT_TRUE(gpu.loadRecords(set));
    while (!test::valueOf(gpu.continueLoading()).finished()) {
    }
    ASSERT_TRUE(gpu.setWeight(set, 0.75f) && cpu.setWeight(set, 0.75f));
    ASSERT_TRUE(gpu.submit());
    cpu.update();
    expectEqual(gpu, cpu);
}

TEST_F(GpuFewTexels, ProbesOfModelsAreThoseOfTheCpuToTheBit) {
    test::Random random(33);
    PackData data = test::modelPack(3, 300, [](glm::vec3) { return glm::vec3(1); });
    for (ProbeRecord& probe : data.probes.base) probe = test::randomProbe(random, data.color_format);
    test::addLightOnProbes(data, 0, test::randomSharedExponent(random), [](glm::vec3 p) { return p.x < 6; });
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack, {.frames_in_flight = 2, .moving_probes_max = 640});
    CpuRuntime cpu(pack, 1, 640);
    std::vector<Model> models;
    const auto anywhere = [&] {
        return Transform{{{{1, 0, 0, test::uniform(random, 0, 12)},
                           {0, 1, 0, test::uniform(random, 0, 4)},
                           {0, 0, 1, test::uniform(random, 0, 12)}}}};
    };
    for (int i = 0; i < 10; ++i) {
        const ModelGrid grid{{-1, -1, -1}, {1, 1, 1}, {4, 4, 4}};
        const Transform place = anywhere();
        models.push_back(test::valueOf(gpu.addModel(grid, place)));
        ASSERT_EQ(test::valueOf(cpu.addModel(grid, place)).index, models.back().index);
    }
    for (int round = 0; round < 4; ++round) {
        for (const Model& model : models) {
            const Transform place = anywhere();
            ASSERT_TRUE(gpu.moveModel(model, place) && cpu.moveModel(model, place));
        }
        const float weight = test::uniform(random, 0, 1);
        ASSERT_TRUE(gpu.setWeight(LightSet{0}, weight) && cpu.setWeight(LightSet{0}, weight));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqual(gpu, cpu);
    }
}

// What a device of these limits says to a pack; empty where it takes it.
template <Limits limits>
std::string refusal(PackData data) {
    const auto device = HeadlessDevice::create({.get_instance_proc_addr = limitedLoader<limits>});
    if (!device) return device.error().message;
    const auto runtime = Runtime::create(device->context(), packOf(std::move(data)));
    if (runtime) return {};
    EXPECT_EQ(runtime.error().code, ErrorCode::Unsupported);
    return runtime.error().message;
}

TEST(GpuLimits, OfBothWaysToReadTablesAreNamedWhereBothAreTooLittle) {
    if (!HeadlessDevice::create()) GTEST_SKIP() << "no Vulkan device";
    test::Random random(34);
    const PackData texels = test::randomPack(34);
    PackData probes = test::emptyPack(4, 1);
    probes.page_count = probes.page_width = probes.page_height = 1;
    test::fillPack(probes, {}, random);
    test::addRandomProbes(probes, random);
    EXPECT_THAT(refusal<Limits{}>(texels), IsEmpty());
    EXPECT_THAT((refusal<Limits{.texels = 64}>(texels)), IsEmpty());
    EXPECT_THAT((refusal<Limits{.texels = 64, .storage_bytes = 4096}>(texels)),
                testing::AllOf(HasSubstr("64 texels of 16 bytes"), HasSubstr("a storage buffer of 4096 bytes")));
    EXPECT_THAT((refusal<Limits{.texels = 64}>(probes)), IsEmpty());
    // The probes themselves, 28 bytes each, are a storage buffer in any case.
    const uint64_t records = probes.probes.numbers.size() + probes.probes.payload.size();
    ASSERT_GT(16 * records, 65000u);
    ASSERT_LT(28 * probes.probes.base.size(), 65000u);
    EXPECT_THAT((refusal<Limits{.texels = 64, .storage_bytes = 65000}>(probes)),
                testing::AllOf(HasSubstr(fmt::format("{} bytes exceeds", 16 * records)),
                               HasSubstr("64 texels (maxTexelBufferElements) or 65000 bytes (maxStorageBufferRange)")));
    // With four, the least that Vulkan allows, tables can only be texel buffers.
    EXPECT_THAT((refusal<Limits{.storage_buffers = 4}>(texels)), IsEmpty());
    EXPECT_THAT((refusal<Limits{.texels = 64, .storage_buffers = 6}>(texels)), IsEmpty());
    EXPECT_THAT((refusal<Limits{.texels = 64, .storage_buffers = 5}>(texels)),
                testing::AllOf(HasSubstr("take 6 storage buffers"), HasSubstr("binds 5")));
    EXPECT_THAT((refusal<Limits{.texels = 64, .storage_buffers = 7}>(probes)),
                testing::AllOf(HasSubstr("take 8 storage buffers"), HasSubstr("binds 7")));
}

// One that has few but wide elements would do as texels, and not as the storage buffer that it becomes with the other.
TEST(GpuLimits, OfStorageBuffersHoldForAllTablesOfAKernel) {
    const auto device =
        HeadlessDevice::create({.get_instance_proc_addr = limitedLoader<Limits{.texels = 64, .storage_bytes = 512}>});
    if (!device) GTEST_SKIP() << device.error().message;
    const VulkanContext vulkan = device->context();
    const GpuTable wide = test::valueOf(createTable(vulkan, 64 * 16, VK_FORMAT_R32G32B32A32_UINT, MemoryUse::Device));
    const GpuTable longer = test::valueOf(createTable(vulkan, 200 * 2, VK_FORMAT_R16_UINT, MemoryUse::Device));
    ASSERT_TRUE(wide.view.get() && !longer.view.get());
    const KernelBinding bindings[] = {KernelBinding::ofTable(wide), KernelBinding::ofTable(longer)};
    const auto refused = Kernel::create(vulkan, {}, bindings, 4, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_THAT(refused.error().message, HasSubstr("1024 bytes exceeds"));
}

// Two more types of memory than the device has, before its own: one for the host, which stands for the device's first
// of that kind, and one of the device alone, which is full.
constexpr uint32_t host_type = 0, full_type = 1, more_types = 2;
constexpr VkMemoryPropertyFlags host_flags = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
uint32_t first_host_type = 0;
bool heaps_all_full = false;
std::vector<uint32_t> types_tried;

VKAPI_ATTR void VKAPI_CALL moreMemoryTypes(VkPhysicalDevice device, VkPhysicalDeviceMemoryProperties* properties) {
    ::vkGetPhysicalDeviceMemoryProperties(device, properties);
    auto* types = properties->memoryTypes;
    std::copy_backward(types, types + properties->memoryTypeCount, types + properties->memoryTypeCount + more_types);
    properties->memoryTypeCount += more_types;
    types[host_type] = {host_flags, 0};
    types[full_type] = {VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0};
    first_host_type = more_types;
    while ((types[first_host_type].propertyFlags & host_flags) != host_flags) ++first_host_type;
}
VKAPI_ATTR void VKAPI_CALL bufferRequirements(VkDevice device, VkBuffer buffer, VkMemoryRequirements* requirements) {
    ::vkGetBufferMemoryRequirements(device, buffer, requirements);
    requirements->memoryTypeBits = requirements->memoryTypeBits << more_types | 1u << host_type | 1u << full_type;
}
VKAPI_ATTR void VKAPI_CALL imageRequirements(VkDevice device, VkImage image, VkMemoryRequirements* requirements) {
    ::vkGetImageMemoryRequirements(device, image, requirements);
    requirements->memoryTypeBits = requirements->memoryTypeBits << more_types | 1u << host_type | 1u << full_type;
}
VKAPI_ATTR VkResult VKAPI_CALL allocateUnlessFull(VkDevice device, const VkMemoryAllocateInfo* info,
                                                  const VkAllocationCallbacks* callbacks, VkDeviceMemory* memory) {
    types_tried.push_back(info->memoryTypeIndex);
    if (heaps_all_full || info->memoryTypeIndex == full_type) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    VkMemoryAllocateInfo own = *info;
    own.memoryTypeIndex = (info->memoryTypeIndex == host_type ? first_host_type : info->memoryTypeIndex) - more_types;
    return ::vkAllocateMemory(device, &own, callbacks, memory);
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL fullLoader(VkInstance instance, const char* name) {
    return oneOf(
        {replaced("vkGetPhysicalDeviceMemoryProperties", moreMemoryTypes),
         replaced("vkGetBufferMemoryRequirements", bufferRequirements),
         replaced("vkGetImageMemoryRequirements", imageRequirements), replaced("vkAllocateMemory", allocateUnlessFull)},
        instance, name);
}

class GpuFullHeap : public test::GpuTest {
   protected:
    static void SetUpTestSuite() { createDevice(fullLoader); }
    static auto bufferFor(MemoryUse use) {
        types_tried.clear();
        return createBuffer(device().context(), 1024, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, use);
    }
};

TEST_F(GpuFullHeap, WhatTheDeviceUsesGoesToTheNextBest) {
    ASSERT_TRUE(bufferFor(MemoryUse::Device));
    EXPECT_EQ(types_tried.size(), 2u);
    EXPECT_EQ(types_tried.front(), full_type);
    EXPECT_GE(types_tried.back(), more_types);
    const Pack pack = packOf(test::randomPack(35));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    ASSERT_TRUE(gpu.submit());
    cpu.update();
    EXPECT_TRUE(std::ranges::equal(test::valueOf(gpu.readPages()).irradiance, cpu.irradiancePages()));
}

TEST_F(GpuFullHeap, WhereAllAreFullThereIsNoMemory) {
    heaps_all_full = true;
    const auto refused = bufferFor(MemoryUse::Device);
    const std::vector<uint32_t> tried_for_device = types_tried;
    const auto staging = bufferFor(MemoryUse::Upload);
    heaps_all_full = false;
    ASSERT_FALSE(refused || staging);
    EXPECT_EQ(refused.error().code, ErrorCode::OutOfMemory);
    EXPECT_EQ(staging.error().code, ErrorCode::OutOfMemory);
    // The device's own before others; what the host writes stays in the best.
    ASSERT_GE(tried_for_device.size(), 3u);
    EXPECT_EQ(tried_for_device.front(), full_type);
    EXPECT_GE(tried_for_device[1], more_types);
    EXPECT_EQ(std::ranges::count(tried_for_device, host_type), 1);
    EXPECT_THAT(types_tried, ElementsAre(host_type));
}

// A loader that offers portability enumeration alone, and a device with the subset; or neither. What was asked of them.
bool offers_portability = false;
struct Asked {
    VkInstanceCreateFlags flags = 0;
    std::vector<std::string> of_instance, of_device;
    bool reinterpretation = false;
} asked_of_vulkan;

constexpr const char* portability_subset = "VK_KHR_portability_subset";
// The beginning of VkPhysicalDevicePortabilitySubsetFeaturesKHR, which is in vulkan_beta.h.
struct SubsetFeatures {
    VkStructureType type;
    void* next;
    VkBool32 constant_alpha_color_blend_factors, events, image_view_format_reinterpretation;
};
constexpr auto subset_features_type = static_cast<VkStructureType>(1000163000);

VkResult listed(const char* name, uint32_t* count, VkExtensionProperties* items) {
    *count = offers_portability ? 1 : 0;
    if (items && offers_portability) {
        *items = {};
        std::string_view(name).copy(items->extensionName, VK_MAX_EXTENSION_NAME_SIZE - 1);
    }
    return VK_SUCCESS;
}
VKAPI_ATTR VkResult VKAPI_CALL instanceExtensions(const char*, uint32_t* count, VkExtensionProperties* items) {
    return listed(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME, count, items);
}
VKAPI_ATTR VkResult VKAPI_CALL deviceExtensions(VkPhysicalDevice, const char*, uint32_t* count,
                                                VkExtensionProperties* items) {
    return listed(portability_subset, count, items);
}
VKAPI_ATTR VkResult VKAPI_CALL createAskedInstance(const VkInstanceCreateInfo* info,
                                                   const VkAllocationCallbacks* callbacks, VkInstance* instance) {
    asked_of_vulkan.flags = info->flags;
    asked_of_vulkan.of_instance.assign(info->ppEnabledExtensionNames,
                                       info->ppEnabledExtensionNames + info->enabledExtensionCount);
    VkInstanceCreateInfo own = *info;
    own.flags = 0;
    own.enabledExtensionCount = 0;
    return ::vkCreateInstance(&own, callbacks, instance);
}
VKAPI_ATTR VkResult VKAPI_CALL createAskedDevice(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                                 const VkAllocationCallbacks* callbacks, VkDevice* device) {
    asked_of_vulkan.of_device.assign(info->ppEnabledExtensionNames,
                                     info->ppEnabledExtensionNames + info->enabledExtensionCount);
    auto features = *static_cast<const VkPhysicalDeviceVulkan12Features*>(info->pNext);
    const auto* subset = static_cast<const SubsetFeatures*>(features.pNext);
    asked_of_vulkan.reinterpretation =
        subset && subset->type == subset_features_type && subset->image_view_format_reinterpretation;
    features.pNext = nullptr;
    VkDeviceCreateInfo own = *info;
    own.pNext = &features;
    own.enabledExtensionCount = 0;
    return ::vkCreateDevice(physical, &own, callbacks, device);
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL portabilityLoader(VkInstance instance, const char* name) {
    return oneOf({replaced("vkEnumerateInstanceExtensionProperties", instanceExtensions),
                  replaced("vkEnumerateDeviceExtensionProperties", deviceExtensions),
                  replaced("vkCreateInstance", createAskedInstance), replaced("vkCreateDevice", createAskedDevice)},
                 instance, name);
}

TEST(GpuPortability, IsAskedForWhereItIsOffered) {
    if (!HeadlessDevice::create()) GTEST_SKIP() << "no Vulkan device";
    for (const bool offered : {true, false}) {
        offers_portability = offered;
        asked_of_vulkan = {};
        const auto device = HeadlessDevice::create({.get_instance_proc_addr = portabilityLoader});
        ASSERT_TRUE(device) << device.error().message;
        EXPECT_EQ(device->context().get_instance_proc_addr, portabilityLoader);
        EXPECT_EQ(asked_of_vulkan.reinterpretation, offered);
        if (offered) {
            EXPECT_EQ(asked_of_vulkan.flags, VkInstanceCreateFlags{VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR});
            EXPECT_THAT(asked_of_vulkan.of_instance, ElementsAre(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME));
            EXPECT_THAT(asked_of_vulkan.of_device, ElementsAre(portability_subset));
        } else {
            EXPECT_EQ(asked_of_vulkan.flags, 0u);
            EXPECT_THAT(asked_of_vulkan.of_instance, IsEmpty());
            EXPECT_THAT(asked_of_vulkan.of_device, IsEmpty());
        }
    }
}

}  // namespace
}  // namespace dimmer
