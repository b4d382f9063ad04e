// What a runtime holds, and how it is read.
#include <gpu/runtime_impl.h>

#include <gpu/vk_result.h>

#include <algorithm>

namespace dimmer {

LightmapImages Runtime::images(uint32_t page_set) const {
    return impl_->pages[std::min<size_t>(page_set, impl_->pages.size() - 1)].images();
}
uint32_t Runtime::pageSet() const {
    return impl_->front;
}

uint32_t Runtime::setCount() const {
    return impl_->page_sets;
}

uint32_t Runtime::probeSet() const {
    return impl_->probe_front;
}

VkBuffer Runtime::probes(uint32_t probe_set) const {
    if (!impl_->atlas) return VK_NULL_HANDLE;
    return impl_->atlas->buffer(std::min(probe_set, impl_->probe_sets - 1));
}

VkBuffer Runtime::gridTable() const {
    return impl_->grid_table ? impl_->grid_table->buffer.get() : VK_NULL_HANDLE;
}

DeviceFootprint Runtime::footprint() const {
    DeviceFootprint footprint;
    for (const LightmapPages& pages : impl_->pages) footprint.bytes += pages.deviceBytes();
    if (impl_->executor) {
        footprint.bytes += impl_->executor->deviceBytes();
        if (impl_->loader) footprint.bytes += impl_->loader->deviceBytes();
        footprint.pipelines = impl_->executor->pipelineCount();
    }
    if (impl_->probes) {
        footprint.bytes += impl_->probes->deviceBytes();
        footprint.pipelines += impl_->probes->pipelineCount();
    }
    if (impl_->atlas) footprint.bytes += impl_->atlas->deviceBytes();
    if (impl_->grid_table) footprint.bytes += impl_->grid_table->size_bytes;
    if (impl_->resampler) {
        footprint.bytes += impl_->resampler->deviceBytes();
        footprint.pipelines += impl_->resampler->pipelineCount();
    }
    return footprint;
}

Expected<Runtime::Pages> Runtime::readPages() {
    DIMMER_TRY(impl_->waitFor(impl_->submitted));  // perhaps on another queue
    auto transfer = Transfer::create(impl_->vulkan, MemoryUse::Readback);
    if (!transfer) return std::unexpected(std::move(transfer.error()));
    auto pages = impl_->pages[impl_->front].read(*transfer);
    if (!pages || !impl_->atlas) return pages;
    auto probes = impl_->atlas->read(impl_->probe_front, *transfer);
    if (!probes) return std::unexpected(std::move(probes.error()));
    pages->probes = std::move(*probes);
    return pages;
}

}  // namespace dimmer
