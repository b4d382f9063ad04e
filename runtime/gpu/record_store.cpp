#include <gpu/record_store.h>

#include <gpu/vk_result.h>

#include <numeric>

namespace dimmer {

Expected<RecordStore> RecordStore::create(const VulkanContext& vulkan, const PackData& data, uint64_t bytes_max) {
    RecordStore store;
    store.data_ = &data;
    store.first_.resize(data.contributions.size());
    store.counts_.resize(data.contributions.size());
    store.runs_.resize(data.contributions.size());
    uint32_t place = 0;
    for (const Cluster& cluster : data.clusters) {
        for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t) {
            const ClusterTerm& term = data.terms[t];
            const auto within = static_cast<uint32_t>(store.counts_[term.contribution]);
            store.within_.push_back(within - place);
            store.runs_[term.contribution].push_back({within, term.first_record, cluster.receiver_count});
            store.counts_[term.contribution] += paddedReceivers(cluster.receiver_count);
        }
        place += paddedReceivers(cluster.receiver_count);
    }
    const uint64_t all = std::accumulate(store.counts_.begin(), store.counts_.end(), uint64_t{0});
    const uint64_t records = bytes_max == 0 ? all : std::min(all, bytes_max / sizeof(TexelRecord) / 2 * 2);
    auto buffer = createTable(vulkan, records * sizeof(TexelRecord), VK_FORMAT_R32G32B32A32_UINT, MemoryUse::Device);
    if (!buffer) return std::unexpected(std::move(buffer.error()));
    store.buffer_ = std::move(*buffer);
    if (records < all) {
        store.pool_ = RecordPool(records, data.contributions.size());
        return store;
    }
    // Ranges of their own: those of a pool, taken back and given out in any order, would come to lie in its way.
    uint64_t first = 0;
    for (const uint64_t count : store.counts_) {
        store.home_.push_back(first);
        first += count;
    }
    return store;
}

bool RecordStore::reserve(uint32_t contribution) {
    if (reserved(contribution)) return true;
    if (!home_.empty()) {
        first_[contribution] = home_[contribution];
        return true;
    }
    const auto first = pool_.allocate(counts_[contribution]);
    if (!first && counts_[contribution] > 0) return false;
    first_[contribution] = first.value_or(0);
    return true;
}

void RecordStore::release(uint32_t contribution) {
    if (!reserved(contribution)) return;
    if (home_.empty()) pool_.release(*first_[contribution], counts_[contribution]);
    first_[contribution].reset();
}

uint64_t RecordStore::freeBytes() const {
    uint64_t bytes = buffer_.buffer.size_bytes;
    for (uint32_t k = 0; k < first_.size(); ++k)
        if (reserved(k)) bytes -= byteCount(k);
    return bytes;
}

uint64_t RecordStore::largestFreeBytes() const {
    return home_.empty() ? pool_.largestFree() * sizeof(TexelRecord) : freeBytes();
}

uint64_t RecordStore::firstByte(uint32_t contribution) const {
    return first_[contribution].value_or(0) * sizeof(TexelRecord);
}

void RecordStore::fill(uint32_t contribution, uint64_t offset, std::span<std::byte> piece) const {
    fillFrom(runs_[contribution], [&](uint32_t i) { return canonical(data_->color_format, data_->payload[i]); })(offset,
                                                                                                                 piece);
}

}  // namespace dimmer
