#include <bake/overlap.h>

#include <bake/sampling.h>

#include <algorithm>
#include <numeric>

namespace dimmer::cook {
namespace {

// The entries of one row that stay, by index into it, ascending.
template <class Entry>
void strongest(std::span<const Entry> row, uint32_t most, std::vector<uint32_t>& kept) {
    kept.resize(row.size());
    std::iota(kept.begin(), kept.end(), 0u);
    // Ties go to the earlier term. Always-on light comes first and stays.
    const auto before = [&](uint32_t a, uint32_t b) {
        const auto rank = [&](uint32_t i) {
            return row[i].term == always_group ? std::numeric_limits<float>::infinity()
                                               : luminance(row[i].light.irradiance());
        };
        const float x = rank(a), y = rank(b);
        return x != y ? x > y : a < b;
    };
    const bool always = !row.empty() && row[0].term == always_group;
    const size_t count = std::min<size_t>(row.size(), size_t{most} + always);
    std::ranges::partial_sort(kept, kept.begin() + static_cast<std::ptrdiff_t>(count), before);
    kept.resize(count);
    std::ranges::sort(kept);
}

template <class Entry>
Sparse<Entry> limited(const Sparse<Entry>& light, uint32_t most) {
    return Sparse<Entry>::build(light.rows(), [&](size_t begin, size_t end, auto&& emit) {
        std::vector<uint32_t> kept;
        std::vector<Entry> entries;
        for (size_t i = begin; i < end; ++i) {
            const std::span<const Entry> row = light.row(i);
            strongest(row, most, kept);
            entries.clear();
            for (const uint32_t k : kept) entries.push_back(row[k]);
            emit(std::span<const Entry>(entries));
        }
    });
}

// Per term, the luminous flux that arrives at all texels, lm. In the order of receivers, so that it is always the same.
std::vector<double> fluxOfTerms(const Sparse<ReceiverLight>& light, std::span<const float> area_m2, size_t terms) {
    std::vector<double> sums(terms, 0);
    for (size_t i = 0; i < light.rows(); ++i)
        for (const ReceiverLight& l : light.row(i))
            sums[l.term] += static_cast<double>(area_m2[i] * luminance(l.light.irradiance()));
    return sums;
}

}  // namespace

void limitOverlap(Baked& baked, std::span<const float> area_m2, uint32_t most) {
    if (most == 0) return;
    const auto before = fluxOfTerms(baked.light, area_m2, baked.terms.size());
    baked.light = limited(baked.light, most);
    if (baked.grid.light.rows() > 0) baked.grid.light = limited(baked.grid.light, most);
    if (baked.local_light.rows() > 0) baked.local_light = limited(baked.local_light, most);
    const auto after = fluxOfTerms(baked.light, area_m2, baked.terms.size());
    for (size_t t = 0; t < baked.reports.size(); ++t)
        if (before[t] > 0)
            baked.reports[t].energy_dropped += (1 - baked.reports[t].energy_dropped) * (1 - after[t] / before[t]);
}

}  // namespace dimmer::cook
