#include <dimmer/cpu_runtime.h>

#include <format/texel.h>
#include <update/planner.h>

#include <chrono>

namespace dimmer {
namespace {

// The twin of main() in shaders/blend_texels.comp.
TexelRecord blendTexel(TexelRecord base, std::span<const WorkTerm> terms, std::span<const TexelRecord> payload,
                       uint32_t receiver) {
    // With nothing on, the page shows the base as cooked: decoding and encoding may move its direction by a quantum.
    if (terms.empty()) return base;
    TexelBlend blend;
    blend.add(base, 1, 1, 1);
    for (const WorkTerm& term : terms)
        blend.add(payload[term.payload_bias + receiver], term.weight_r, term.weight_g, term.weight_b);
    return blend.encode();
}

size_t texelIndex(const PackData& data, uint32_t address) {
    return (size_t{TexelAddress::page(address)} * data.page_height + TexelAddress::y(address)) * data.page_width +
           TexelAddress::x(address);
}

TexelRecord baseRecord(const PackData& data, size_t texel) {
    const TexelRecord& record = data.base_pages[texel];
    return {clampR11G11B10(record.irradiance), record.direction};
}

}  // namespace

CpuRuntime::CpuRuntime(const Pack& pack) : LightState(pack) {
    const PackData& data = pack.data();
    irradiance_.resize(data.base_pages.size());
    direction_.resize(data.base_pages.size());
    for (size_t i = 0; i < data.base_pages.size(); ++i) {
        const TexelRecord base = baseRecord(data, i);
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
        for (const WorkGroup& group : work.groups) stats.dispatches += group.item_count > 0;
        for (const WorkItem& item : work.items) {
            const auto terms = work.terms.subspan(item.first_term, item.term_count);
            for (uint32_t i = item.first_receiver; i < item.first_receiver + item.receiver_count; ++i) {
                const size_t texel = texelIndex(data, data.addresses[i]);
                const TexelRecord blended = blendTexel(baseRecord(data, texel), terms, data.payload, i);
                irradiance_[texel] = blended.irradiance;
                direction_[texel] = blended.direction;
            }
        }
    }
    stats.host_us = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
    return stats;
}

}  // namespace dimmer
