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
                                                        std::span<const LightmapPages> page_sets, Transfer& transfer) {
    if (page_sets.size() > 1 && (mode == UpdateMode::Gather || mode == UpdateMode::Scatter))
        return fail(ErrorCode::Unsupported, "Modes gather and scatter update pages in place only.");
    switch (mode) {
        case UpdateMode::Gather:
            return boxed(GatherBlender::create(vulkan, data, page_sets.front(), transfer));
        case UpdateMode::Scatter:
            return boxed(ScatterBlender::create(vulkan, data, page_sets.front(), transfer));
        case UpdateMode::WorkList:
        case UpdateMode::PerCombination:
            break;
    }
    return boxed(TexelBlender::create(vulkan, data, planner, page_sets, transfer, mode == UpdateMode::PerCombination));
}

}  // namespace dimmer
