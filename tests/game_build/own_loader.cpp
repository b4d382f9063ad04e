// An engine that loads Vulkan by itself, as with volk: it has variables with the names of Vulkan's functions, and the
// linker takes them for the functions wherever a library calls those. With its own loader named, and with none.
#define VK_NO_PROTOTYPES
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <dlfcn.h>
#include <gpu/vulkan_functions.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#define GAME_OTHER_FUNCTIONS(X) \
    X(vkGetInstanceProcAddr)    \
    X(vkCreateInstance)         \
    X(vkDestroyInstance)

// Hidden, as volk's are: what libvulkan calls must not be these.
#pragma GCC visibility push(hidden)
extern "C" {
#define GAME_VARIABLE(name) PFN_##name name;
DIMMER_VULKAN_FUNCTIONS(GAME_VARIABLE)
GAME_OTHER_FUNCTIONS(GAME_VARIABLE)
}
#pragma GCC visibility pop

namespace {

constexpr int no_device = 77;  // as CMakeLists.txt says

void need(bool done, const char* what) {
    if (done) return;
    std::printf("failed: %s\n", what);
    std::exit(1);
}

VkInstance createInstance() {
    void* library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    need(library, "libvulkan.so.1");
    vkGetInstanceProcAddr = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library, "vkGetInstanceProcAddr"));
    need(vkGetInstanceProcAddr, "vkGetInstanceProcAddr");
    vkCreateInstance = reinterpret_cast<PFN_vkCreateInstance>(vkGetInstanceProcAddr(nullptr, "vkCreateInstance"));
    VkApplicationInfo application{};
    application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    application.apiVersion = VK_API_VERSION_1_2;
    VkInstanceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    info.pApplicationInfo = &application;
    VkInstance instance = VK_NULL_HANDLE;
    if (vkCreateInstance(&info, nullptr, &instance) != VK_SUCCESS) std::exit(no_device);
#define GAME_LOAD(name) name = reinterpret_cast<PFN_##name>(vkGetInstanceProcAddr(instance, #name));
    DIMMER_VULKAN_FUNCTIONS(GAME_LOAD)
    GAME_LOAD(vkDestroyInstance)
    return instance;
}

// On the first device that computes.
dimmer::VulkanContext createDevice(VkInstance instance) {
    uint32_t count = 1, family_count = 1;
    dimmer::VulkanContext vulkan{.instance = instance};
    vkEnumeratePhysicalDevices(instance, &count, &vulkan.physical_device);
    if (count == 0) std::exit(no_device);
    VkQueueFamilyProperties family{};
    vkGetPhysicalDeviceQueueFamilyProperties(vulkan.physical_device, &family_count, &family);
    need(family.queueFlags & VK_QUEUE_COMPUTE_BIT, "a first queue family that computes");

    const float priority = 1;
    VkDeviceQueueCreateInfo queue{};
    queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkPhysicalDeviceVulkan12Features features{};
    features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    features.timelineSemaphore = VK_TRUE;
    VkDeviceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    info.pNext = &features;
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queue;
    need(vkCreateDevice(vulkan.physical_device, &info, nullptr, &vulkan.device) == VK_SUCCESS, "vkCreateDevice");
    vkGetDeviceQueue(vulkan.device, 0, 0, &vulkan.queue);
    vulkan.get_instance_proc_addr = vkGetInstanceProcAddr;
    return vulkan;
}

void dimSets(dimmer::LightState& lights) {
    for (uint32_t i = 0; i < lights.pack().elements().size(); ++i)
        if (lights.pack().elements()[i].kind == dimmer::ElementKind::LightSet)
            need(lights.setWeight(dimmer::LightSet{i}, 0.5f).has_value(), "setWeight");
}

// The pages, half lit: as the CPU, which calls no Vulkan, blends them.
void blend(const dimmer::VulkanContext& vulkan, const dimmer::Pack& pack) {
    auto lights = dimmer::Runtime::create(vulkan, pack);
    if (!lights) std::printf("%s\n", lights.error().message.c_str());
    need(lights.has_value(), "Runtime::create");
    dimmer::CpuRuntime expected(pack);
    dimSets(*lights);
    dimSets(expected);
    expected.update();
    const auto stats = lights->submit();
    need(stats && stats->dispatches > 0, "an update with work");
    const auto pages = lights->readPages();
    need(pages.has_value(), "readPages");
    need(std::ranges::equal(pages->irradiance, expected.irradiancePages()), "the CPU's irradiance");
    need(std::ranges::equal(pages->direction, expected.directionPages()), "the CPU's directions");
}

}  // namespace

int main() {
    const auto pack = dimmer::Pack::open(GAME_PACK);
    need(pack.has_value(), GAME_PACK);
    const VkInstance instance = createInstance();
    dimmer::VulkanContext vulkan = createDevice(instance);
    blend(vulkan, *pack);
    vulkan.get_instance_proc_addr = nullptr;
    blend(vulkan, *pack);
    vkDestroyDevice(vulkan.device, nullptr);
    vkDestroyInstance(instance, nullptr);
    return 0;
}
