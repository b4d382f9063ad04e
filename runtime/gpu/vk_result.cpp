#include <fmt/format.h>
#include <gpu/vk_result.h>

namespace dimmer {

std::unexpected<Error> vulkanError(VkResult result, std::string_view call) {
    switch (result) {
        case VK_ERROR_DEVICE_LOST:
            return fail(ErrorCode::DeviceLost,
                        fmt::format("{}: the Vulkan device is lost. Destroy the runtime and create it anew.", call));
        case VK_ERROR_OUT_OF_HOST_MEMORY:
            return fail(ErrorCode::OutOfMemory, fmt::format("{}: out of host memory.", call));
        case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        case VK_ERROR_OUT_OF_POOL_MEMORY:
        case VK_ERROR_FRAGMENTED_POOL:
        case VK_ERROR_TOO_MANY_OBJECTS:
            return fail(ErrorCode::OutOfMemory, fmt::format("{}: out of device memory.", call));
        case VK_ERROR_FEATURE_NOT_PRESENT:
        case VK_ERROR_EXTENSION_NOT_PRESENT:
        case VK_ERROR_LAYER_NOT_PRESENT:
        case VK_ERROR_FORMAT_NOT_SUPPORTED:
        case VK_ERROR_INCOMPATIBLE_DRIVER:
            return fail(ErrorCode::Unsupported, fmt::format("{}: the Vulkan device or driver lacks something that is "
                                                            "needed (VkResult {}).",
                                                            call, static_cast<int>(result)));
        default:
            return fail(ErrorCode::Internal, fmt::format("{} failed (VkResult {}).", call, static_cast<int>(result)));
    }
}

}  // namespace dimmer
