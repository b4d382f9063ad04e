#include <gpu/texel_executor.h>

#include <gpu/naive_blenders.h>
#include <gpu/texel_blender.h>

namespace dimmer {
namespace {

template <class T>
Expected<std::unique_ptr<TexelExecutor>> boxed(Expected<T> made) {
    if (!made) return std::unexpected(std::move(made.error()));
    return std::make_unique<T>(std::move(*made));
}

}  // namespace

Expected<std::unique_ptr<TexelExecutor>> createExecutor(const VulkanContext& vulkan, UpdateMode mode,
                                                        const PackData& data, const Planner& planner,
                                                        const LightmapPages& pages, Transfer& transfer) {
    switch (mode) {
        case UpdateMode::Gather:
            return boxed(GatherBlender::create(vulkan, data, pages, transfer));
        case UpdateMode::Scatter:
            return boxed(ScatterBlender::create(vulkan, data, pages, transfer));
        case UpdateMode::WorkList:
        case UpdateMode::PerCombination:
            break;
    }
    return boxed(TexelBlender::create(vulkan, data, planner, pages, transfer, mode == UpdateMode::PerCombination));
}

}  // namespace dimmer
