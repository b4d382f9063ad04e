#include <update/plan_tables.h>

#include <format/texel.h>

#include <algorithm>
#include <array>
#include <bit>

namespace dimmer {
namespace {

// Pairs (list, value) into lists; values keep their order.
template <class T, class ForEachPair>
Lists<T> makeLists(size_t list_count, ForEachPair&& for_each_pair) {
    Lists<T> lists;
    lists.first.assign(list_count + 1, 0);
    for_each_pair([&](uint32_t list, const T&) { ++lists.first[list + 1]; });
    for (size_t i = 1; i <= list_count; ++i) lists.first[i] += lists.first[i - 1];
    lists.values.resize(lists.first[list_count]);
    std::vector<uint32_t> next = lists.first;
    for_each_pair([&](uint32_t list, const T& value) { lists.values[next[list]++] = value; });
    return lists;
}

// The step between codes, a power of two, at a value of the base; where it is black, that of the smallest number.
std::array<float, 3> stepsAt(ColorFormat format, uint32_t base) {
    if (format == ColorFormat::E5B9G9R9) {
        const float step = stepE5B9G9R9(base);  // all channels share the largest one's
        return {step, step, step};
    }
    const auto step = [](float value, float mantissa_steps) {
        const uint32_t binade = std::bit_cast<uint32_t>(std::max(value, 0x1p-14f)) & 0x7f800000u;
        return std::bit_cast<float>(binade) / mantissa_steps;
    };
    const auto light = decodeR11G11B10(base);
    return {step(light[0], 64), step(light[1], 64), step(light[2], 32)};
}

}  // namespace

PlanTables::PlanTables(const PackData& data, const ReceiverView& receivers) {
    contributions_of_element = makeLists<uint32_t>(data.elements.size(), [&](auto pair) {
        for (uint32_t k = 0; k < data.contributions.size(); ++k) {
            const Contribution& c = data.contributions[k];
            if (c.light_set) pair(*c.light_set, k);
            for (uint32_t door : c.doors_open) pair(door, k);
            for (uint32_t door : c.doors_closed) pair(door, k);
        }
    });
    holders_of_contribution = makeLists<Holder>(data.contributions.size(), [&](auto pair) {
        for (uint32_t i = 0; i < receivers.clusters.size(); ++i) {
            const Cluster& c = receivers.clusters[i];
            for (uint32_t t = c.first_term; t < c.first_term + c.term_count; ++t)
                pair(receivers.terms[t].contribution, Holder{i, t});
        }
    });
    for (const Cluster& c : receivers.clusters) overlap_max = std::max(overlap_max, c.term_count);
}

std::vector<float> quantaPerWeight(const PackData& data) {
    const ColorFormat format = data.color_format;
    std::vector<float> quanta(data.terms.size(), 0);
    for (const Cluster& c : data.clusters)
        for (uint32_t i = 0; i < c.receiver_count; ++i) {
            const TexelRecord& base = data.base_pages[texelIndex(data, data.addresses[c.first_receiver + i])];
            const auto steps = stepsAt(format, canonical(format, base).irradiance);
            for (uint32_t t = c.first_term; t < c.first_term + c.term_count; ++t) {
                const TexelRecord& record = data.payload[data.terms[t].first_record + i];
                const auto light = decodeColor(format, canonical(format, record).irradiance);
                for (size_t n = 0; n < 3; ++n) quanta[t] = std::max(quanta[t], light[n] / steps[n]);
            }
        }
    return quanta;
}

}  // namespace dimmer
