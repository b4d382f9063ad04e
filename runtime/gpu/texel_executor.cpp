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

Expected<std::unique_ptr<TexelExecutor>> createExecutor(const VulkanContext& vulkan, const RuntimeOptions& options,
                                                        const PackData& data, const Planner& planner,
                                                        std::span<const LightmapPages> page_sets, Transfer& transfer) {
    const bool compares = options.mode == UpdateMode::Gather || options.mode == UpdateMode::Scatter;
    if (compares && (page_sets.size() > 1 || options.frames_in_flight > 1 || !options.load_records ||
                     options.records_bytes_max > 0))
        return fail(ErrorCode::Unsupported,
                    "Modes gather and scatter update pages in place, one frame at a time, with all records loaded.");
    switch (options.mode) {
        case UpdateMode::Gather:
            return boxed(GatherBlender::create(vulkan, data, page_sets.front(), transfer));
        case UpdateMode::Scatter:
            return boxed(ScatterBlender::create(vulkan, data, page_sets.front(), transfer));
        case UpdateMode::WorkList:
        case UpdateMode::PerCombination:
            break;
    }
    return boxed(TexelBlender::create(vulkan, data, planner, page_sets, transfer, options));
}

}  // namespace dimmer
