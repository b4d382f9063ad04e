#include <dimmer/cpu_runtime.h>

#include <cpu/batch_blend.h>
#include <cpu/worker_pool.h>
#include <format/probe.h>
#include <probes/model_slots.h>
#include <probes/resample.h>
#include <update/planner.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstring>

namespace dimmer {
namespace {

// Updates of fewer batches are over before another thread has woken up.
constexpr size_t batches_per_thread_min = 256;
// What a thread takes at a time: large beside the counter that it is taken by, small beside an update.
constexpr size_t batches_taken = 64;

struct Pages {
    uint32_t *irradiance, *direction;
    const TexelRecord* base;  // per receiver
};

// The twin of shaders/blend_texels.comp for one batch.
template <ColorFormat format>
void blendBatch(const WorkItem& item, std::span<const WorkTerm> terms, const PackData& data, const Pages& pages) {
    const Batch& batch = data.batches[item.batch];
    const uint32_t offset = batch.first_receiver - data.clusters[item.cluster].first_receiver;
    std::array<size_t, batch_receivers_max> texels;
    std::array<TexelRecord, batch_receivers_max> records;
    for (uint32_t i = 0; i < batch.receiver_count; ++i) {
        texels[i] = texelIndex(data, data.addresses[batch.first_receiver + i]);
#ifdef __GNUC__
        // Rows of a page are kilobytes apart, which no hardware foresees: by the time of the stores they are here.
        __builtin_prefetch(pages.irradiance + texels[i], 1);
        __builtin_prefetch(pages.direction + texels[i], 1);
#endif
        records[i] = pages.base[batch.first_receiver + i];
    }
    if (terms.empty()) {  // the page shows the base as cooked
        for (uint32_t i = 0; i < batch.receiver_count; ++i) records[i] = canonical(format, records[i]);
    } else {
        BatchBlend<format> blend(batch.receiver_count);
        constexpr float one = weightScale(format);
        blend.add(records.data(), one, one, one);
        for (const WorkTerm& term : terms)
            blend.add(&data.payload[data.terms[term.term].first_record + offset], term.weight_r, term.weight_g,
                      term.weight_b);
        blend.encode(records.data());
    }
    for (uint32_t i = 0; i < batch.receiver_count; ++i) {
        pages.irradiance[texels[i]] = records[i].irradiance;
        pages.direction[texels[i]] = records[i].direction;
    }
}

template <ColorFormat format>
void blendItems(std::span<const WorkItem> items, const WorkList& work, const PackData& data, const Pages& pages) {
    for (const WorkItem& item : items)
        blendBatch<format>(item, work.terms.subspan(item.first_term, item.term_count), data, pages);
}

// The twin of shaders/blend_probes.comp.
template <ColorFormat format>
void blendProbes(std::span<const WorkItem> items, const WorkList& work, const PackData& data,
                 std::vector<uint32_t>& probes) {
    for (const WorkItem& item : items) {
        const Batch& batch = data.probes.batches[item.batch];
        const uint32_t first = data.probes.clusters[item.cluster].first_receiver;
        for (uint32_t i = batch.first_receiver; i < batch.first_receiver + batch.receiver_count; ++i) {
            const uint32_t number = data.probes.numbers[i];
            ProbeRecord record = canonicalProbe(format, data.probes.base[number]);
            if (item.term_count > 0) {
                ProbeBlend<format> sum;
                constexpr float one = weightScale(format);
                sum.add(record, one, one, one);
                for (const WorkTerm& term : work.terms.subspan(item.first_term, item.term_count))
                    sum.add(data.probes.payload[data.probes.terms[term.term].first_record + i - first], term.weight_r,
                            term.weight_g, term.weight_b);
                record = sum.encode();
            }
            std::memcpy(&probes[words_per_probe * number], &record, sizeof(record));
        }
    }
}

}  // namespace

CpuRuntime::CpuRuntime(const Pack& pack, uint32_t threads, uint32_t moving_probes_max)
    : LightState(pack, 1, moving_probes_max) {
    if (threads > 1) pool_ = std::make_unique<WorkerPool>(std::min(threads, WorkerPool::threads_max));
    const PackData& data = pack.data();
    irradiance_.resize(data.base_pages.size());
    direction_.resize(data.base_pages.size());
    for (size_t i = 0; i < data.base_pages.size(); ++i) {
        const TexelRecord base = canonical(data.color_format, data.base_pages[i]);
        irradiance_[i] = base.irradiance;
        direction_[i] = base.direction;
    }
    probes_.resize(words_per_probe * (data.probes.base.size() + models().probesMax()));
    hints_.assign(models().probesMax(), no_tetrahedron);
    for (size_t i = 0; i < data.probes.base.size(); ++i) {
        const ProbeRecord base = canonicalProbe(data.color_format, data.probes.base[i]);
        std::memcpy(&probes_[words_per_probe * i], &base, sizeof(base));
    }
    for (uint32_t address : data.addresses) base_.push_back(data.base_pages[texelIndex(data, address)]);
}

CpuRuntime::~CpuRuntime() = default;
CpuRuntime::CpuRuntime(CpuRuntime&&) noexcept = default;
CpuRuntime& CpuRuntime::operator=(CpuRuntime&&) noexcept = default;

// No two items write the same receiver, so it does not matter who takes which.
template <class Blend>
void CpuRuntime::forItems(const WorkList& work, const Blend& blend) {
    if (!pool_ || work.items.size() < batches_per_thread_min * pool_->threads()) return blend(work.items);
    std::atomic<size_t> next = 0;
    pool_->run([&](uint32_t) {
        for (;;) {
            const size_t first = next.fetch_add(batches_taken);
            if (first >= work.items.size()) return;
            blend(work.items.subspan(first, std::min(batches_taken, work.items.size() - first)));
        }
    });
}

template <ColorFormat format>
void CpuRuntime::updateTexels() {
    const PackData& data = pack().data();
    const WorkList& work = planner().work();
    const Pages pages{irradiance_.data(), direction_.data(), base_.data()};
    forItems(work, [&](std::span<const WorkItem> items) { blendItems<format>(items, work, data, pages); });
}

template <ColorFormat format>
void CpuRuntime::updateProbes() {
    const PackData& data = pack().data();
    const WorkList& work = probePlanner().work();
    forItems(work, [&](std::span<const WorkItem> items) { blendProbes<format>(items, work, data, probes_); });
}

void CpuRuntime::updateModels(UpdateStats& stats) {
    const PackData& data = pack().data();
    const auto items = models().take(0);
    for (const ResampleItem& item : items)
        resampleItem(data, item, static_cast<uint32_t>(data.probes.base.size()), probes_, hints_);
    countResampled(items, stats);
    ++stats.dispatches;
}

UpdateStats CpuRuntime::update() {
    const auto start = std::chrono::steady_clock::now();
    const bool shared_exponent = pack().data().color_format == ColorFormat::E5B9G9R9;
    const auto countDispatches = [](const WorkList& work) {
        return static_cast<uint32_t>(
            std::ranges::count_if(work.groups, [](const WorkGroup& group) { return group.item_count > 0; }));
    };
    const bool texels = planner().plan();
    UpdateStats stats = planner().stats();
    if (texels) {
        stats.dispatches += countDispatches(planner().work());
        shared_exponent ? updateTexels<ColorFormat::E5B9G9R9>() : updateTexels<ColorFormat::R11G11B10F>();
    }
    if (hasProbes() && probePlanner().plan()) {
        stats.dispatches += countDispatches(probePlanner().work());
        shared_exponent ? updateProbes<ColorFormat::E5B9G9R9>() : updateProbes<ColorFormat::R11G11B10F>();
        addProbes(probePlanner().stats(), stats);
        models().touch(0, probePlanner().work().items);
    }
    if (models().dirty(0)) updateModels(stats);
    stats.host_us = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
    return stats;
}

}  // namespace dimmer
