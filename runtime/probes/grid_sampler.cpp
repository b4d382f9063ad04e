#include <dimmer/probe_grid.h>

#include <format/probe.h>
#include <pack/pack_data.h>
#include <probes/spherical_harmonics.h>
#include <probes/tetrahedron_walk.h>

#include <algorithm>
#include <bit>

namespace dimmer {
namespace {

// Whether `words` hold the probes 0 .. end - 1.
bool holds(std::span<const uint32_t> words, uint64_t end) {
    return words.size() / words_per_probe >= end;
}

// One past a slot's last probe; past all probes where it is no slot, as that of a local grid that is not there.
uint64_t endOf(const ModelSlot& slot) {
    uint64_t count = 1;
    for (const uint32_t n : slot.counts) {
        if (n < 1 || n > local_grid_side_max) return UINT64_MAX;
        count *= n;
    }
    return slot.first_probe + count;
}

// Adds weight * the light of a probe.
void add(const ProbeRecord& record, ColorFormat format, float weight, Radiance& sum) {
    const auto light = decodeColor(format, canonicalProbe(format, record).light);
    const auto codes = std::bit_cast<std::array<int8_t, probe_codes>>(record.bands);
    for (size_t c = 0; c < 3; ++c) {
        const float dc = weight * light[c];
        sum.coefficients[0][c] += dc;
        for (size_t i = 1; i < sh_count; ++i)
            sum.coefficients[i][c] +=
                dc * band_bounds[bandOf(i)] * (static_cast<float>(codes[3 * (i - 1) + c]) / 127.0f);
    }
}

}  // namespace

std::array<float, 3> irradiance(const Radiance& radiance, std::array<float, 3> normal) {
    return transferredIrradiance(radiance, normalTransfer(normal));
}

std::array<float, 3> transferredIrradiance(const Radiance& radiance, const LightTransfer& transfer) {
    std::array<float, 3> sum = {};
    for (size_t i = 0; i < sh_count; ++i)
        for (size_t c = 0; c < 3; ++c) sum[c] += transfer.coefficients[i] * radiance.coefficients[i][c];
    for (float& v : sum) v = std::max(v, 0.0f);
    return sum;
}

bool GridSampler::empty() const {
    return pack_.data().probes.global.empty();
}

Radiance GridSampler::radiance(std::array<float, 3> point_m, GridHint* hint) const {
    Radiance sum;
    const PackData& data = pack_.data();
    if (empty() || !holds(probes_, data.probes.global.positions.size())) return sum;
    const GlobalGrid& grid = data.probes.global;
    const GridPlace place = locate(grid, point_m, hint ? hint->tetrahedron : no_tetrahedron);
    if (hint) hint->tetrahedron = place.tetrahedron;
    const auto weights = probeWeights(grid, place);
    for (size_t i = 0; i < 4; ++i) {
        const ProbeRecord record = probeAt(probes_, grid.tetrahedra[place.tetrahedron].probes[i]);
        add(record, data.color_format, weights[i] / data.exposure, sum);
    }
    return sum;
}

std::array<float, 3> GridSampler::sample(std::array<float, 3> point_m, std::array<float, 3> normal,
                                         GridHint* hint) const {
    return irradiance(radiance(point_m, hint), normal);
}

Radiance GridSampler::radiance(const ModelSlot& slot, std::array<float, 3> point_m) const {
    if (!holds(probes_, endOf(slot))) return {};
    std::array<uint32_t, 3> low;
    std::array<float, 3> share;
    for (size_t i = 0; i < 3; ++i) {
        const auto& row = slot.grid_from_world[i];
        const float at = row[0] * point_m[0] + row[1] * point_m[1] + row[2] * point_m[2] + row[3];
        const auto last = static_cast<float>(slot.counts[i] - 1);
        const float inside = at > 0 ? (at < last ? at : last) : 0.0f;
        low[i] = std::min(static_cast<uint32_t>(inside), std::max(slot.counts[i], 2u) - 2);
        share[i] = inside - static_cast<float>(low[i]);
    }
    Radiance sum;
    const PackData& data = pack_.data();
    for (uint32_t corner = 0; corner < 8; ++corner) {
        float weight = 1;
        uint32_t number = slot.first_probe, stride = 1;
        for (size_t i = 0; i < 3; ++i) {
            const uint32_t step = corner >> i & 1;
            weight *= step ? share[i] : 1 - share[i];
            number += stride * (low[i] + step);
            stride *= slot.counts[i];
        }
        if (weight > 0) add(probeAt(probes_, number), data.color_format, weight / data.exposure, sum);
    }
    return sum;
}

std::array<float, 3> GridSampler::sampleTransfer(const ModelSlot& slot, std::array<float, 3> point_m,
                                                 const LightTransfer& transfer) const {
    return transferredIrradiance(radiance(slot, point_m), transfer);
}

std::array<float, 3> GridSampler::sample(const ModelSlot& slot, std::array<float, 3> point_m,
                                         std::array<float, 3> normal) const {
    return irradiance(radiance(slot, point_m), normal);
}

}  // namespace dimmer
