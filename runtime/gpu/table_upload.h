// Tables of a pack on the device, in the device's order.
#pragma once

#include <format/texel.h>
#include <gpu/kernel.h>
#include <gpu/transfer.h>

#include <algorithm>
#include <initializer_list>
#include <vector>

namespace dimmer {

// Four words to a texel of a table.
inline constexpr VkFormat wide_format = VK_FORMAT_R32G32B32A32_UINT;
// 64 suits GPUs; lavapipe is within 3 % of its best from 64 to 512.
inline constexpr uint32_t workgroup_size = 64;

// What a dispatch of a blend kernel works on, in the work list.
struct DispatchedItems {
    uint32_t first_item, item_count;
};

// Consecutive values of the pack that lie side by side on the device.
struct Run {
    uint32_t to, from, count;
};

// For Transfer::upload: value(i) is the pack's i-th; `runs` ascend by `to`, gaps between them are zero.
template <class Value>
auto fillFrom(const std::vector<Run>& runs, Value value) {
    return [&runs, value](VkDeviceSize offset, std::span<std::byte> piece) {
        using T = decltype(value(0u));
        auto* out = reinterpret_cast<T*>(piece.data());
        const uint64_t first = offset / sizeof(T), end = first + piece.size() / sizeof(T);
        std::fill(piece.begin(), piece.end(), std::byte{0});
        auto run = std::ranges::upper_bound(runs, first, {}, [](const Run& r) { return uint64_t{r.to} + r.count; });
        for (; run != runs.end() && run->to < end; ++run) {
            const uint64_t begin = std::max<uint64_t>(run->to, first);
            const uint64_t stop = std::min<uint64_t>(uint64_t{run->to} + run->count, end);
            for (uint64_t i = begin; i < stop; ++i)
                out[i - first] = value(static_cast<uint32_t>(run->from + i - run->to));
        }
    };
}

inline Expected<GpuTable> uploadTable(const VulkanContext& vulkan, Transfer& transfer, VkDeviceSize size_bytes,
                                      VkFormat format,
                                      const std::function<void(VkDeviceSize, std::span<std::byte>)>& fill) {
    auto table = createTable(vulkan, size_bytes, format, MemoryUse::Device);
    if (!table) return table;
    if (auto ok = transfer.upload(table->buffer.buffer.get(), size_bytes, fill); !ok)
        return std::unexpected(std::move(ok.error()));
    return table;
}

inline Expected<void> keep(Expected<GpuTable> made, GpuTable& slot) {
    if (!made) return std::unexpected(std::move(made.error()));
    slot = std::move(*made);
    return {};
}

inline uint64_t bytesOf(std::initializer_list<const GpuTable*> tables) {
    uint64_t sum = 0;
    for (const GpuTable* table : tables) sum += table->buffer.size_bytes;
    return sum;
}

// A whole vector as it is.
template <class T>
Expected<GpuTable> uploadTable(const VulkanContext& vulkan, Transfer& transfer, const std::vector<T>& values,
                               VkFormat format) {
    const auto bytes = std::as_bytes(std::span(values));
    return uploadTable(vulkan, transfer, bytes.size(), format,
                       [bytes](VkDeviceSize offset, std::span<std::byte> piece) {
                           std::ranges::copy(bytes.subspan(offset, piece.size()), piece.begin());
                       });
}

// What the base pages hold at a receiver of the pack.
inline TexelRecord baseAt(const PackData& data, uint32_t receiver) {
    return canonical(data.color_format, data.base_pages[texelIndex(data, data.addresses[receiver])]);
}

// The grid of a dispatch in rows, as one side is limited (65535 on some devices); kernels skip the last row's rest.
inline void dispatchRows(VkCommandBuffer commands, uint32_t workgroups, uint32_t columns_max) {
    const uint32_t columns = std::min(workgroups, columns_max);
    vkCmdDispatch(commands, columns, (workgroups + columns - 1) / columns, 1);
}

}  // namespace dimmer
