// The runtime's own pointers to Vulkan's functions, taken from the loader that its caller names.
#include <dimmer/cpu_runtime.h>
#include <gmock/gmock.h>
#include <gpu/vulkan_functions.h>

#include "gpu_fixture.h"
#include "pages.h"

#include <array>
#include <atomic>
#include <string_view>
#include <thread>
#include <vector>

namespace dimmer {
namespace {

using testing::HasSubstr;

// Two loaders that know every function, and give one of their own for all of them.
VKAPI_ATTR void VKAPI_CALL functionOfA() {}
VKAPI_ATTR void VKAPI_CALL functionOfB() {}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL loaderA(VkInstance, const char*) {
    return functionOfA;
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL loaderB(VkInstance, const char*) {
    return functionOfB;
}
const auto dispatch_of_a = reinterpret_cast<PFN_vkCmdDispatch>(&functionOfA);
const auto dispatch_of_b = reinterpret_cast<PFN_vkCmdDispatch>(&functionOfB);

uint32_t functions_asked_for = 0;
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL countingLoader(VkInstance instance, const char* name) {
    ++functions_asked_for;
    return vkGetInstanceProcAddr(instance, name);
}
// Vulkan 1.1's.
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL oldLoader(VkInstance instance, const char* name) {
    return std::string_view(name) == "vkWaitSemaphores" ? nullptr : vkGetInstanceProcAddr(instance, name);
}

TEST(VulkanFunctions, OthersAreRefusedWhileSomeAreInUse) {
    auto first = VulkanFunctions::load(loaderA, VK_NULL_HANDLE);
    auto second = VulkanFunctions::load(loaderA, VK_NULL_HANDLE);
    ASSERT_TRUE(first && second);
    EXPECT_EQ(vkCmdDispatch, dispatch_of_a);
    *first = {};
    const auto refused = VulkanFunctions::load(loaderB, VK_NULL_HANDLE);
    ASSERT_FALSE(refused) << "the second is there still";
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_THAT(refused.error().message, HasSubstr("get_instance_proc_addr"));
    EXPECT_EQ(vkCmdDispatch, dispatch_of_a);
    *second = {};
    EXPECT_TRUE(VulkanFunctions::load(loaderB, VK_NULL_HANDLE));
    EXPECT_EQ(vkCmdDispatch, dispatch_of_b);
}

TEST(VulkanFunctions, AreLoadedByManyThreadsAtOnce) {
    std::vector<std::jthread> threads;
    std::atomic<uint32_t> refused = 0, wrong = 0;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&] {
            for (int k = 0; k < 1000; ++k) {
                const auto held = VulkanFunctions::load(loaderA, VK_NULL_HANDLE);
                if (!held) ++refused;
                if (vkCmdDispatch != dispatch_of_a) ++wrong;
            }
        });
    threads.clear();
    EXPECT_EQ(refused, 0u);
    EXPECT_EQ(wrong, 0u);
    EXPECT_TRUE(VulkanFunctions::load(loaderB, VK_NULL_HANDLE)) << "nobody holds the others any more";
}

TEST(VulkanFunctions, LibrariesThatAreNotThereArePassedBy) {
    const std::array missing = {"libno_such_loader.so.1", "libno_such_loader.so"};
    EXPECT_EQ(loaderOf(missing), nullptr);
    EXPECT_EQ(loaderOf(std::array{missing[0], "libvulkan.so.1"}), vkGetInstanceProcAddr);
    EXPECT_EQ(installedLoader(), vkGetInstanceProcAddr) << "what this program is linked with is the one installed";
}

using VulkanFunctionsGpu = test::GpuTest;

TEST_F(VulkanFunctionsGpu, AreThoseOfTheLoaderThatTheContextNames) {
    const Pack pack = test::packOf(test::randomPack(1));
    VulkanContext vulkan = device().context();
    vulkan.get_instance_proc_addr = countingLoader;
    functions_asked_for = 0;
    auto runtime = Runtime::create(vulkan, pack);
    ASSERT_TRUE(runtime) << runtime.error().message;
    EXPECT_GT(functions_asked_for, 0u);
    const auto pages = runtime->readPages();
    ASSERT_TRUE(pages) << pages.error().message;
    EXPECT_TRUE(std::ranges::equal(pages->irradiance, CpuRuntime(pack).irradiancePages()));
}

TEST_F(VulkanFunctionsGpu, OneThatIsMissingIsNamed) {
    VulkanContext vulkan = device().context();
    vulkan.get_instance_proc_addr = oldLoader;
    const auto refused = Runtime::create(vulkan, test::packOf(test::randomPack(1)));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_THAT(refused.error().message, HasSubstr("vkWaitSemaphores"));
}

// With a device of its own, which has no function of Vulkan 1.2 whatever the loader says.
TEST_F(VulkanFunctionsGpu, AnInstanceOfAnEarlierVersionIsTold) {
    const auto function = [](VkInstance of, auto& pointer, const char* name) {
        pointer = reinterpret_cast<std::remove_reference_t<decltype(pointer)>>(vkGetInstanceProcAddr(of, name));
    };
    PFN_vkCreateInstance create = nullptr;
    function(VK_NULL_HANDLE, create, "vkCreateInstance");
    for (const uint32_t version : {VK_API_VERSION_1_0, VK_API_VERSION_1_1}) {
        VkApplicationInfo application{};
        application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
        application.apiVersion = version;
        VkInstanceCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
        info.pApplicationInfo = &application;
        VulkanContext vulkan = device().context();
        ASSERT_EQ(create(&info, nullptr, &vulkan.instance), VK_SUCCESS);
        PFN_vkEnumeratePhysicalDevices enumerate = nullptr;
        PFN_vkCreateDevice create_device = nullptr;
        PFN_vkDestroyDevice destroy_device = nullptr;
        PFN_vkGetDeviceQueue queue_of = nullptr;
        PFN_vkDestroyInstance destroy = nullptr;
        function(vulkan.instance, enumerate, "vkEnumeratePhysicalDevices");
        function(vulkan.instance, create_device, "vkCreateDevice");
        function(vulkan.instance, destroy_device, "vkDestroyDevice");
        function(vulkan.instance, queue_of, "vkGetDeviceQueue");
        function(vulkan.instance, destroy, "vkDestroyInstance");
        uint32_t count = 1;
        ASSERT_GE(enumerate(vulkan.instance, &count, &vulkan.physical_device), VK_SUCCESS);
        const float priority = 1;
        VkDeviceQueueCreateInfo queue{};
        queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
        queue.queueFamilyIndex = vulkan.queue_family;
        queue.queueCount = 1;
        queue.pQueuePriorities = &priority;
        VkDeviceCreateInfo device_info{};
        device_info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
        device_info.queueCreateInfoCount = 1;
        device_info.pQueueCreateInfos = &queue;
        ASSERT_EQ(create_device(vulkan.physical_device, &device_info, nullptr, &vulkan.device), VK_SUCCESS);
        queue_of(vulkan.device, vulkan.queue_family, 0, &vulkan.queue);
        const auto refused = Runtime::create(vulkan, test::packOf(test::randomPack(1)));
        destroy_device(vulkan.device, nullptr);
        destroy(vulkan.instance, nullptr);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
        EXPECT_THAT(refused.error().message, HasSubstr("VkApplicationInfo::apiVersion"));
    }
}

}  // namespace
}  // namespace dimmer
