#include <dimmer/cpu_runtime.h>

#include <format/texel.h>
#include <update/planner.h>

#include <array>
#include <chrono>

namespace dimmer {
namespace {

size_t texelIndex(const PackData& data, uint32_t address) {
    return (size_t{TexelAddress::page(address)} * data.page_height + TexelAddress::y(address)) * data.page_width +
           TexelAddress::x(address);
}

using Records = std::array<TexelRecord, batch_receivers_max>;
template <ColorFormat format>
using Sums = std::array<TexelBlend<format>, batch_receivers_max>;

template <ColorFormat format>
void add(Sums<format>& sums, const TexelRecord* records, uint32_t count, float wr, float wg, float wb) {
    for (uint32_t i = 0; i < count; ++i) sums[i].add(canonical(format, records[i]), wr, wg, wb);
}

// The twin of shaders/blend_texels.comp for one batch. Term by term over all receivers: records are read as they
// lie, and the compiler vectorises the loops.
template <ColorFormat format>
void blendBatch(const WorkItem& item, std::span<const WorkTerm> terms, const PackData& data, Records& records) {
    const Batch& batch = data.batches[item.batch];
    for (uint32_t i = 0; i < batch.receiver_count; ++i)
        records[i] = canonical(format, data.base_pages[texelIndex(data, data.addresses[batch.first_receiver + i])]);
    // With nothing on, the page shows the base as cooked.
    if (terms.empty()) return;
    const Cluster& cluster = data.clusters[item.cluster];
    Sums<format> sums{};
    constexpr float one = weightScale(format);
    add<format>(sums, records.data(), batch.receiver_count, one, one, one);
    for (const WorkTerm& term : terms) {
        const uint32_t first = data.terms[term.term].first_record;
        add<format>(sums, &data.payload[first + (batch.first_receiver - cluster.first_receiver)], batch.receiver_count,
                    term.weight_r, term.weight_g, term.weight_b);
    }
    for (uint32_t i = 0; i < batch.receiver_count; ++i) records[i] = sums[i].encode();
}

}  // namespace

CpuRuntime::CpuRuntime(const Pack& pack) : LightState(pack) {
    const PackData& data = pack.data();
    irradiance_.resize(data.base_pages.size());
    direction_.resize(data.base_pages.size());
    for (size_t i = 0; i < data.base_pages.size(); ++i) {
        const TexelRecord base = canonical(data.color_format, data.base_pages[i]);
        irradiance_[i] = base.irradiance;
        direction_[i] = base.direction;
    }
}

UpdateStats CpuRuntime::update() {
    const auto start = std::chrono::steady_clock::now();
    const bool any = planner().plan();
    UpdateStats stats = planner().stats();
    if (any) {
        const PackData& data = pack().data();
        const WorkList& work = planner().work();
        Records records;
        const auto blend = data.color_format == ColorFormat::R11G11B10F ? blendBatch<ColorFormat::R11G11B10F>
                                                                        : blendBatch<ColorFormat::E5B9G9R9>;
        for (const WorkGroup& group : work.groups) stats.dispatches += group.item_count > 0;
        for (const WorkItem& item : work.items) {
            blend(item, work.terms.subspan(item.first_term, item.term_count), data, records);
            const Batch& batch = data.batches[item.batch];
            for (uint32_t i = 0; i < batch.receiver_count; ++i) {
                const size_t texel = texelIndex(data, data.addresses[batch.first_receiver + i]);
                irradiance_[texel] = records[i].irradiance;
                direction_[texel] = records[i].direction;
            }
        }
    }
    stats.host_us = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
    return stats;
}

}  // namespace dimmer
