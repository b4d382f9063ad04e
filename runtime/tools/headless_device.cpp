#include <fmt/format.h>
#include <gpu/queue_family.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <gpu/vulkan_functions.h>
#include <tools/headless_device.h>

#include <algorithm>
#include <mutex>
#include <optional>

namespace dimmer {

struct MessageLog {
    std::mutex mutex;
    std::vector<std::string> messages;
};

namespace {

constexpr const char* validation_layer = "VK_LAYER_KHRONOS_validation";
constexpr const char* driver_on_cpu = "On Debian the package mesa-vulkan-drivers brings one that runs on the CPU.";

VKAPI_ATTR VkBool32 VKAPI_CALL onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    auto& log = *static_cast<MessageLog*>(user);
    const std::scoped_lock lock(log.mutex);
    log.messages.emplace_back(data->pMessage);
    return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messengerInfo(MessageLog& log) {
    auto info = vkStruct<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
    info.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    info.pfnUserCallback = onMessage;
    info.pUserData = &log;
    return info;
}

// Of all that `enumerate(count, items)` lists, whether one's `name` member is that.
template <class Item, size_t size, class Enumerate>
bool lists(Enumerate&& enumerate, char (Item::*member)[size], std::string_view name) {
    uint32_t count = 0;
    enumerate(&count, nullptr);
    std::vector<Item> items(count);
    enumerate(&count, items.data());
    return std::ranges::any_of(items, [&](const Item& item) { return item.*member == name; });
}

// A family that draws and computes, else, where drawing is not asked for, one that computes.
std::optional<uint32_t> findQueueFamily(VkPhysicalDevice device, bool graphics) {
    const auto families = queueFamilies(device);
    constexpr VkQueueFlags both = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
    for (uint32_t i = 0; i < families.size(); ++i)
        if ((families[i].queueFlags & both) == both) return i;
    for (uint32_t i = 0; i < families.size() && !graphics; ++i)
        if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) return i;
    return std::nullopt;
}

bool hasTimelineSemaphores(VkPhysicalDevice device) {
    auto features12 = vkStruct<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
    auto features = vkStruct<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &features12);
    vkGetPhysicalDeviceFeatures2(device, &features);
    return features12.timelineSemaphore;
}

// A second queue for compute beside the one in `main`: of a family that does not draw, else another of the same family.
struct ComputeQueue {
    uint32_t family, index;
};
std::optional<ComputeQueue> findComputeQueue(VkPhysicalDevice device, uint32_t main) {
    const auto families = queueFamilies(device);
    for (uint32_t i = 0; i < families.size(); ++i)
        if (i != main && (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) &&
            !(families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT))
            return ComputeQueue{i, 0};
    if (families[main].queueCount > 1) return ComputeQueue{main, 1};
    return std::nullopt;
}

// Smaller is better.
int preference(VkPhysicalDeviceType type) {
    switch (type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return 0;
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return 1;
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return 2;
        default:
            return 3;
    }
}

}  // namespace

struct HeadlessDevice::Impl {
    MessageLog log;  // before the instance: its messenger writes here to the very end
    VulkanFunctions functions;
    VulkanContext vulkan;
    PFN_vkGetInstanceProcAddr loader = nullptr;
    VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
    std::string name, driver;

    ~Impl() {
        if (vulkan.device) vkDestroyDevice(vulkan.device, nullptr);
        if (messenger) {
            const auto destroy = function<PFN_vkDestroyDebugUtilsMessengerEXT>("vkDestroyDebugUtilsMessengerEXT");
            destroy(vulkan.instance, messenger, nullptr);
        }
        if (vulkan.instance) function<PFN_vkDestroyInstance>("vkDestroyInstance")(vulkan.instance, nullptr);
    }

    // Before there is an instance, those alone that need none.
    template <class Function>
    Function function(const char* called) const {
        return reinterpret_cast<Function>(loader(vulkan.instance, called));
    }
    bool layerInstalled(const char* layer) const;
    bool instanceHas(const char* extension) const;
    bool deviceHas(const char* extension) const;
    Expected<void> createInstance(bool validation);
    Expected<void> choosePhysicalDevice(bool graphics);
    Expected<void> createDevice(bool compute_queue);
};

bool HeadlessDevice::Impl::layerInstalled(const char* layer) const {
    const auto enumerate = function<PFN_vkEnumerateInstanceLayerProperties>("vkEnumerateInstanceLayerProperties");
    return lists(enumerate, &VkLayerProperties::layerName, layer);
}

bool HeadlessDevice::Impl::instanceHas(const char* extension) const {
    const auto enumerate =
        function<PFN_vkEnumerateInstanceExtensionProperties>("vkEnumerateInstanceExtensionProperties");
    const auto all = [&](uint32_t* count, VkExtensionProperties* items) { enumerate(nullptr, count, items); };
    return lists(all, &VkExtensionProperties::extensionName, extension);
}

bool HeadlessDevice::Impl::deviceHas(const char* extension) const {
    const auto enumerate = function<PFN_vkEnumerateDeviceExtensionProperties>("vkEnumerateDeviceExtensionProperties");
    const auto all = [&](uint32_t* count, VkExtensionProperties* items) {
        enumerate(vulkan.physical_device, nullptr, count, items);
    };
    return lists(all, &VkExtensionProperties::extensionName, extension);
}

Expected<void> HeadlessDevice::Impl::createInstance(bool validation) {
    if (!loader) return fail(ErrorCode::Unsupported, "Vulkan's loader is not installed (Debian: libvulkan1).");
    if (validation && !layerInstalled(validation_layer))
        return fail(
            ErrorCode::Unsupported,
            fmt::format("The Vulkan layer {} is not installed (Debian: vulkan-validationlayers).", validation_layer));

    auto application = vkStruct<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
    application.pApplicationName = "Dimmer";
    application.apiVersion = VK_API_VERSION_1_2;

    const VkValidationFeatureEnableEXT enabled[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    auto features = vkStruct<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = enabled;
    VkDebugUtilsMessengerCreateInfoEXT debug = messengerInfo(log);
    debug.pNext = &features;

    std::vector<const char*> extensions;
    auto info = vkStruct<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    info.pApplicationInfo = &application;
    // Devices that lack a part of Vulkan (MoltenVK's) the loader shows to those alone that ask for them.
    if (instanceHas(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME)) {
        extensions.push_back(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
        info.flags = VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR;
    }
    if (validation) {
        info.pNext = &debug;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &validation_layer;
        extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    }
    info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();
    const auto vkCreateInstance = function<PFN_vkCreateInstance>("vkCreateInstance");
    const VkResult created = vkCreateInstance(&info, nullptr, &vulkan.instance);
    if (created == VK_ERROR_INCOMPATIBLE_DRIVER)
        return fail(ErrorCode::Unsupported, fmt::format("No Vulkan driver was found. {}", driver_on_cpu));
    if (created < 0) return vulkanError(created, "vkCreateInstance");
    auto loaded = VulkanFunctions::load(loader, vulkan.instance);
    if (!loaded) return std::unexpected(std::move(loaded.error()));
    functions = std::move(*loaded);

    if (validation) {
        const auto create = function<PFN_vkCreateDebugUtilsMessengerEXT>("vkCreateDebugUtilsMessengerEXT");
        const VkDebugUtilsMessengerCreateInfoEXT messenger_info = messengerInfo(log);
        DIMMER_VK(create, vulkan.instance, &messenger_info, nullptr, &messenger);
    }
    return {};
}

Expected<void> HeadlessDevice::Impl::choosePhysicalDevice(bool graphics) {
    uint32_t count = 0;
    DIMMER_VK(vkEnumeratePhysicalDevices, vulkan.instance, &count, nullptr);
    std::vector<VkPhysicalDevice> devices(count);
    DIMMER_VK(vkEnumeratePhysicalDevices, vulkan.instance, &count, devices.data());

    int best = 4;
    for (VkPhysicalDevice candidate : devices) {
        auto driver_properties =
            vkStruct<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES);
        auto properties = vkStruct<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
        vkGetPhysicalDeviceProperties(candidate, &properties.properties);
        if (properties.properties.apiVersion < VK_API_VERSION_1_2 || !hasTimelineSemaphores(candidate)) continue;
        const auto family = findQueueFamily(candidate, graphics);
        const int rank = preference(properties.properties.deviceType);
        if (!family || rank >= best) continue;

        properties.pNext = &driver_properties;
        vkGetPhysicalDeviceProperties2(candidate, &properties);
        best = rank;
        vulkan.physical_device = candidate;
        vulkan.queue_family = *family;
        name = properties.properties.deviceName;
        driver = fmt::format("{} {}", driver_properties.driverName, driver_properties.driverInfo);
    }
    if (!vulkan.physical_device)
        return fail(ErrorCode::Unsupported,
                    fmt::format("No Vulkan 1.2 device with a queue for {} was found among {}. {}",
                                graphics ? "drawing and compute" : "compute", count, driver_on_cpu));
    return {};
}

Expected<void> HeadlessDevice::Impl::createDevice(bool compute_queue) {
    const float priorities[] = {1, 1};
    std::optional<ComputeQueue> compute;
    if (compute_queue) compute = findComputeQueue(vulkan.physical_device, vulkan.queue_family);
    const bool same_family = compute && compute->family == vulkan.queue_family;
    VkDeviceQueueCreateInfo queues[2];
    for (VkDeviceQueueCreateInfo& queue : queues) {
        queue = vkStruct<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
        queue.queueFamilyIndex = vulkan.queue_family;
        queue.queueCount = 1;
        queue.pQueuePriorities = priorities;
    }
    if (same_family) queues[0].queueCount = 2;
    if (compute) queues[1].queueFamilyIndex = compute->family;
    auto features = vkStruct<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
    features.timelineSemaphore = VK_TRUE;
    auto info = vkStruct<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &features);
    info.queueCreateInfoCount = compute && !same_family ? 2 : 1;
    info.pQueueCreateInfos = queues;
    // Whoever has the extension demands that it is enabled. Pages are written through views of another format.
    const char* const portability = VK_KHR_PORTABILITY_SUBSET_EXTENSION_NAME;
    auto subset = vkStruct<VkPhysicalDevicePortabilitySubsetFeaturesKHR>(
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PORTABILITY_SUBSET_FEATURES_KHR);
    if (deviceHas(portability)) {
        subset.imageViewFormatReinterpretation = VK_TRUE;
        features.pNext = &subset;
        info.enabledExtensionCount = 1;
        info.ppEnabledExtensionNames = &portability;
    }
    DIMMER_VK(vkCreateDevice, vulkan.physical_device, &info, nullptr, &vulkan.device);
    vkGetDeviceQueue(vulkan.device, vulkan.queue_family, 0, &vulkan.queue);
    if (!compute) return {};
    vulkan.compute_queue_family = compute->family;
    vkGetDeviceQueue(vulkan.device, compute->family, compute->index, &vulkan.compute_queue);
    return {};
}

Expected<HeadlessDevice> HeadlessDevice::create(const HeadlessOptions& options) {
    auto impl = std::make_unique<Impl>();
    impl->vulkan.get_instance_proc_addr = options.get_instance_proc_addr;
    impl->loader = options.get_instance_proc_addr ? options.get_instance_proc_addr : installedLoader();
    DIMMER_TRY(impl->createInstance(options.validation));
    DIMMER_TRY(impl->choosePhysicalDevice(options.graphics));
    DIMMER_TRY(impl->createDevice(options.compute_queue));
    return HeadlessDevice(std::move(impl));
}

HeadlessDevice::HeadlessDevice(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HeadlessDevice::~HeadlessDevice() = default;
HeadlessDevice::HeadlessDevice(HeadlessDevice&&) noexcept = default;
HeadlessDevice& HeadlessDevice::operator=(HeadlessDevice&&) noexcept = default;

VulkanContext HeadlessDevice::context() const {
    return impl_->vulkan;
}
const std::string& HeadlessDevice::name() const {
    return impl_->name;
}
const std::string& HeadlessDevice::driver() const {
    return impl_->driver;
}

std::vector<std::string> HeadlessDevice::validationMessages() const {
    const std::scoped_lock lock(impl_->log.mutex);
    return impl_->log.messages;
}

}  // namespace dimmer
