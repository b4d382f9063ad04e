#include <fmt/format.h>
#include <gpu/vulkan_functions.h>

#include <array>
#include <mutex>

namespace dimmer {

#define DIMMER_DEFINE(name) PFN_##name name = nullptr;
DIMMER_VULKAN_FUNCTIONS(DIMMER_DEFINE)
#undef DIMMER_DEFINE

namespace linked {
// In a namespace, so that no other code finds it; a function with C's linkage is the same in all of them.
extern "C" VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL vkGetInstanceProcAddr(VkInstance instance, const char* name);
}  // namespace linked

namespace {

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

PFN_vkGetInstanceProcAddr linkedLoader() {
    return linked::vkGetInstanceProcAddr;
}

Expected<VulkanFunctions> VulkanFunctions::load(PFN_vkGetInstanceProcAddr get_instance_proc_addr, VkInstance instance) {
    const auto get = get_instance_proc_addr ? get_instance_proc_addr : linkedLoader();
    FunctionList found;
    for (size_t i = 0; i < found.size(); ++i) {
        found[i] = get(instance, function_names[i]);
        if (!found[i])
            return fail(ErrorCode::Unsupported,
                        fmt::format("Vulkan's loader has no {} for VulkanContext::instance. Create the instance for "
                                    "Vulkan 1.2 (VkApplicationInfo::apiVersion).",
                                    function_names[i]));
    }
    const std::scoped_lock lock(functions_mutex);
    if (functions_holders == 0)
        use(found);
    else if (found != functions_in_use)
        return fail(ErrorCode::Unsupported,
                    "VulkanContext::get_instance_proc_addr gives other functions than those of a runtime that lives. "
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
