#include <gpu/vulkan_functions.h>

#include <fmt/format.h>

#include <array>
#include <mutex>

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <windows.h>
#else
#include <dlfcn.h>
#endif

namespace dimmer {

#define DIMMER_DEFINE(name) PFN_##name name = nullptr;
DIMMER_VULKAN_FUNCTIONS(DIMMER_DEFINE)
#undef DIMMER_DEFINE

namespace {

#if defined(_WIN32)
constexpr std::array loader_libraries{"vulkan-1.dll"};
PFN_vkVoidFunction symbolOf(const char* library, const char* name) {
    const HMODULE opened = LoadLibraryA(library);
    return opened ? reinterpret_cast<PFN_vkVoidFunction>(GetProcAddress(opened, name)) : nullptr;
}
#else
#if defined(__APPLE__)
constexpr std::array loader_libraries{"libvulkan.1.dylib", "libvulkan.dylib", "libMoltenVK.dylib"};
#else
constexpr std::array loader_libraries{"libvulkan.so.1", "libvulkan.so"};
#endif
PFN_vkVoidFunction symbolOf(const char* library, const char* name) {
    void* const opened = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    return opened ? reinterpret_cast<PFN_vkVoidFunction>(dlsym(opened, name)) : nullptr;
}
#endif

#define DIMMER_NAME(name) #name,
constexpr std::array function_names{DIMMER_VULKAN_FUNCTIONS(DIMMER_NAME)};
#undef DIMMER_NAME

using FunctionList = std::array<PFN_vkVoidFunction, function_names.size()>;

std::mutex functions_mutex;      // of the two below, and of changes of the pointers
uint32_t functions_holders = 0;  // VulkanFunctions that live
FunctionList functions_in_use{};

void use(const FunctionList& found) {
    functions_in_use = found;
    size_t next = 0;
#define DIMMER_ASSIGN(name) name = reinterpret_cast<PFN_##name>(found[next++]);
    DIMMER_VULKAN_FUNCTIONS(DIMMER_ASSIGN)
#undef DIMMER_ASSIGN
}

}  // namespace

PFN_vkGetInstanceProcAddr loaderOf(std::span<const char* const> libraries) {
    for (const char* library : libraries)
        if (const auto found = symbolOf(library, "vkGetInstanceProcAddr"))
            return reinterpret_cast<PFN_vkGetInstanceProcAddr>(found);
    return nullptr;
}

PFN_vkGetInstanceProcAddr installedLoader() {
    static const PFN_vkGetInstanceProcAddr loader = loaderOf(loader_libraries);
    return loader;
}

Expected<VulkanFunctions> VulkanFunctions::load(PFN_vkGetInstanceProcAddr get_instance_proc_addr, VkInstance instance) {
    const auto get = get_instance_proc_addr ? get_instance_proc_addr : installedLoader();
    if (!get)
        return fail(ErrorCode::Unsupported,
                    fmt::format("Vulkan's loader, {}, is not installed or cannot be opened. Install it, or set "
                                "get_instance_proc_addr to the one that the instance is of.",
                                loader_libraries[0]));
    FunctionList found;
    for (size_t i = 0; i < found.size(); ++i) {
        found[i] = get(instance, function_names[i]);
        if (!found[i])
            return fail(ErrorCode::Unsupported,
                        fmt::format("Vulkan's loader has no {} for the instance that is given. Create the instance for "
                                    "Vulkan 1.2 (VkApplicationInfo::apiVersion).",
                                    function_names[i]));
    }
    const std::scoped_lock lock(functions_mutex);
    if (functions_holders == 0)
        use(found);
    else if (found != functions_in_use)
        return fail(ErrorCode::Unsupported,
                    "get_instance_proc_addr gives other functions than those of a runtime that lives. "
                    "Give all runtimes the same loader's.");
    ++functions_holders;
    VulkanFunctions held;
    held.held_ = true;
    return held;
}

VulkanFunctions::~VulkanFunctions() {
    if (!held_) return;
    const std::scoped_lock lock(functions_mutex);
    --functions_holders;
}

}  // namespace dimmer
