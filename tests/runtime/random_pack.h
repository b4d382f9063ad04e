// Packs with random records, for tests: seeded, so that a failure can be repeated.
#pragma once

#include <fmt/format.h>
#include <pack/batches.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace dimmer::test {

using Random = std::mt19937;

inline float uniform(Random& random, float low, float high) {
    return low + (high - low) * (static_cast<float>(random() >> 8) * 0x1p-24f);
}
// In low..high, both included.
inline uint32_t pick(Random& random, uint32_t low, uint32_t high) {
    return low + static_cast<uint32_t>(random()) % (high - low + 1);
}

// Unsigned float code of a positive number, rounded down; written from the format's definition.
inline uint32_t floorUfloatCode(double value, int mantissa_bits) {
    int exponent = 0;
    const double fraction = std::frexp(value, &exponent);  // value = fraction * 2^exponent, fraction in [0.5, 1)
    const double scale = std::ldexp(1.0, mantissa_bits);
    if (exponent - 1 < -14) return 0;  // the format's users keep no denormal codes
    const auto mantissa = static_cast<uint32_t>((fraction * 2 - 1) * scale);
    return static_cast<uint32_t>(exponent - 1 + 15) << mantissa_bits | mantissa;
}

// 1e-3..1e5 lux per channel, evenly over the decades; now and then black.
inline uint32_t randomIrradiance(Random& random, float exposure) {
    auto stored = [&] { return std::pow(10.0, uniform(random, -3, 5)) * exposure; };
    if (pick(random, 0, 30) == 0) return 0;
    return floorUfloatCode(stored(), 6) | floorUfloatCode(stored(), 6) << 11 | floorUfloatCode(stored(), 5) << 22;
}

// 1e-3..1e5 lux in the largest channel at an exposure of 1/64; any mantissas.
inline uint32_t randomSharedExponent(Random& random) {
    if (pick(random, 0, 30) == 0) return 0;
    return static_cast<uint32_t>(random() & 0x7ffffff) | pick(random, 2, 26) << 27;
}

// Any ambient share, and a highlight that may point along the surface or past what the share allows.
inline uint32_t randomDirection(Random& random) {
    return pick(random, 0, 1023) | pick(random, 1, 1023) << 10 | pick(random, 1, 1023) << 20;
}

inline TexelRecord randomRecord(Random& random, float exposure, ColorFormat format = ColorFormat::R11G11B10F) {
    const uint32_t irradiance =
        format == ColorFormat::E5B9G9R9 ? randomSharedExponent(random) : randomIrradiance(random, exposure);
    return {irradiance, randomDirection(random)};
}

// A cluster to build: which contributions and how many receivers.
struct ClusterPlan {
    std::vector<uint32_t> contributions;  // ascending
    uint32_t receivers = 0;
};

// The addresses of all texels, page by page: a page's 8x8 tiles in random order, and the texels in each tile.
inline std::vector<uint32_t> randomAddresses(const PackData& data, Random& random) {
    std::vector<std::vector<uint32_t>> tiles;
    size_t page_begin = 0;
    const auto shuffle = [&](auto begin, auto end) {
        for (auto n = end - begin; n > 1; --n) std::swap(begin[n - 1], begin[static_cast<int64_t>(random() % n)]);
    };
    for (uint32_t page = 0; page < data.page_count; ++page) {
        for (uint32_t ty = 0; ty < data.page_height; ty += 8)
            for (uint32_t tx = 0; tx < data.page_width; tx += 8) {
                std::vector<uint32_t>& tile = tiles.emplace_back();
                for (uint32_t y = ty; y < std::min(ty + 8, data.page_height); ++y)
                    for (uint32_t x = tx; x < std::min(tx + 8, data.page_width); ++x)
                        tile.push_back(TexelAddress::pack(page, x, y));
                shuffle(tile.begin(), tile.end());
            }
        shuffle(tiles.begin() + static_cast<int64_t>(page_begin), tiles.end());
        page_begin = tiles.size();
    }
    std::vector<uint32_t> addresses;
    for (const std::vector<uint32_t>& tile : tiles) addresses.insert(addresses.end(), tile.begin(), tile.end());
    return addresses;
}

// Fills everything that follows from elements, contributions, pages and the plans: base, addresses, batches, terms, and
// records. A cluster that reaches past its page goes on as another one.
inline void fillPack(PackData& data, std::span<const ClusterPlan> plans, Random& random,
                     uint32_t batch_size = batch_receivers_max) {
    data.base_pages.resize(size_t{data.page_count} * data.page_width * data.page_height);
    for (TexelRecord& record : data.base_pages) record = randomRecord(random, data.exposure, data.color_format);

    const std::vector<uint32_t> addresses = randomAddresses(data, random);
    const auto addCluster = [&](const ClusterPlan& plan) {
        Cluster cluster;
        cluster.first_receiver = static_cast<uint32_t>(data.addresses.size());
        cluster.receiver_count = plan.receivers;
        cluster.first_batch = static_cast<uint32_t>(data.batches.size());
        cluster.first_term = static_cast<uint32_t>(data.terms.size());
        cluster.term_count = static_cast<uint32_t>(plan.contributions.size());
        const auto first = addresses.begin() + cluster.first_receiver;
        data.addresses.insert(data.addresses.end(), first, first + plan.receivers);
        cutIntoBatches(data.addresses, data.page_width, cluster.first_receiver, data.batches, batch_size);
        cluster.batch_count = static_cast<uint32_t>(data.batches.size()) - cluster.first_batch;
        for (uint32_t k : plan.contributions) {
            data.terms.push_back({k, data.contributions[k].receivers});  // within the contribution, for now
            data.contributions[k].receivers += plan.receivers;
        }
        data.clusters.push_back(cluster);
    };
    for (ClusterPlan plan : plans)
        for (uint32_t left = plan.receivers; left > 0; left -= plan.receivers) {
            plan.receivers =
                static_cast<uint32_t>(countOnPage(std::span(addresses).subspan(data.addresses.size(), left)));
            addCluster(plan);
        }

    std::vector<uint32_t> first(data.contributions.size() + 1, 0);
    for (size_t k = 0; k < data.contributions.size(); ++k) first[k + 1] = first[k] + data.contributions[k].receivers;
    for (ClusterTerm& term : data.terms) term.first_record += first[term.contribution];
    data.payload.resize(first.back());
    for (TexelRecord& record : data.payload) record = randomRecord(random, data.exposure, data.color_format);
}

// Light sets "set0".. and doors "door0"..; for every set a contribution, and some through open, off closed and through
// two doors; sets 0 and 1 accept weights up to 2.
inline PackData emptyPack(uint32_t sets, uint32_t doors) {
    PackData data;
    // 1e5 lux on a dozen contributions at weight 2 stays finite: 24e5 / 64 = 37500 < 64512.
    data.exposure = 1.0f / 64;
    for (uint32_t i = 0; i < sets; ++i)
        data.elements.push_back({fmt::format("set{}", i), ElementKind::LightSet, i < 2 ? 2.0f : 1.0f});
    for (uint32_t i = 0; i < doors; ++i) data.elements.push_back({fmt::format("door{}", i), ElementKind::Door, 1});
    auto add = [&](std::optional<uint32_t> set, std::vector<uint32_t> open, std::vector<uint32_t> closed) {
        data.contributions.push_back({set, std::move(open), std::move(closed), 0, 0});
    };
    for (uint32_t i = 0; i < sets; ++i) add(i, {}, {});
    for (uint32_t d = 0; d < doors; ++d) {
        add(std::nullopt, {sets + d}, {});
        add(std::nullopt, {}, {sets + d});
        add(d % sets, {sets + d}, {});
        add((d + 1) % sets, {}, {sets + d});
    }
    if (doors >= 2) add(0u, {sets, sets + 1}, {});
    if (doors >= 2) add(1u, {sets}, {sets + 1});
    return data;
}

struct RandomPackOptions {
    uint32_t sets = 9, doors = 3, clusters = 40;
    uint32_t overlap_max = 12;
    uint32_t page_count = 2, page_side = 64;
    ColorFormat color_format = ColorFormat::R11G11B10F;
};

inline PackData randomPack(uint32_t seed, const RandomPackOptions& options = {}) {
    Random random(seed);
    PackData data = emptyPack(options.sets, options.doors);
    data.color_format = options.color_format;
    data.page_count = options.page_count;
    data.page_width = options.page_side;
    data.page_height = options.page_side;

    const auto contributions = static_cast<uint32_t>(data.contributions.size());
    std::vector<ClusterPlan> plans(options.clusters);
    for (uint32_t i = 0; i < options.clusters; ++i) {
        std::vector<uint32_t> all(contributions);
        std::iota(all.begin(), all.end(), 0u);
        for (size_t j = all.size(); j > 1; --j) std::swap(all[j - 1], all[random() % j]);
        // Every overlap occurs.
        all.resize(std::min(contributions, 1 + i % options.overlap_max));
        std::sort(all.begin(), all.end());
        plans[i] = {std::move(all), pick(random, 1, 150)};
    }
    fillPack(data, plans, random);
    return data;
}

inline ProbeRecord randomProbe(Random& random, ColorFormat format) {
    ProbeRecord probe{.light = randomRecord(random, 1.0f / 64, format).irradiance, .bands = {}};
    for (uint32_t& word : probe.bands) word = static_cast<uint32_t>(random());
    return probe;
}

// Light probes with clusters of their own; some probes change with nothing.
inline void addRandomProbes(PackData& data, Random& random, uint32_t clusters = 25) {
    ProbeData& probes = data.probes;
    const auto contributions = static_cast<uint32_t>(data.contributions.size());
    probes.record_counts.assign(contributions, 0);
    for (uint32_t i = 0; i < clusters; ++i) {
        Cluster cluster{.first_receiver = static_cast<uint32_t>(probes.numbers.size()),
                        .receiver_count = pick(random, 1, 150),
                        .first_batch = static_cast<uint32_t>(probes.batches.size()),
                        .batch_count = 0,
                        .first_term = static_cast<uint32_t>(probes.terms.size()),
                        .term_count = 0};
        for (uint32_t done = 0; done < cluster.receiver_count; done += batch_receivers_max, ++cluster.batch_count)
            probes.batches.push_back(
                {cluster.first_receiver + done, std::min(batch_receivers_max, cluster.receiver_count - done)});
        for (uint32_t k = i % 3; k < contributions; k += pick(random, 1, 4), ++cluster.term_count) {
            probes.terms.push_back({k, probes.record_counts[k]});
            probes.record_counts[k] += cluster.receiver_count;
        }
        probes.numbers.resize(probes.numbers.size() + cluster.receiver_count);
        probes.clusters.push_back(cluster);
    }
    probes.base.resize(probes.numbers.size() + 7);
    for (ProbeRecord& probe : probes.base) probe = randomProbe(random, data.color_format);
    std::vector<uint32_t> numbers(probes.base.size());
    std::iota(numbers.begin(), numbers.end(), 0u);
    for (size_t i = numbers.size(); i > 1; --i) std::swap(numbers[i - 1], numbers[random() % i]);
    std::copy_n(numbers.begin(), probes.numbers.size(), probes.numbers.begin());
    std::vector<uint32_t> first(contributions + 1, 0);
    for (size_t k = 0; k < contributions; ++k) first[k + 1] = first[k] + probes.record_counts[k];
    for (ClusterTerm& term : probes.terms) term.first_record += first[term.contribution];
    probes.payload.resize(first.back());
    for (ProbeRecord& record : probes.payload) record = randomProbe(random, data.color_format);
}

// A state in text form: each element on, off or in between, scalar or RGB.
inline std::string randomState(const PackData& data, Random& random) {
    std::string state;
    auto number = [&](float max) {
        switch (pick(random, 0, 3)) {
            case 0:
                return 0.0f;
            case 1:
                return max;
            default:
                return uniform(random, 0, max);
        }
    };
    for (const Element& element : data.elements) {
        if (pick(random, 0, 2) == 0) continue;
        const bool door = element.kind == ElementKind::Door;
        const float max = element.max_weight;
        state += fmt::format("{}{}{}={}", state.empty() ? "" : ",", door ? "door:" : "", element.name, number(max));
        if (!door && pick(random, 0, 1)) state += fmt::format("/{}/{}", number(max), number(max));
    }
    return state;
}

inline ModelVertex randomModelVertex(Random& random) {
    ModelVertex v;
    for (auto& p : v.position) p = static_cast<uint16_t>(random());
    for (auto& n : v.normal) n = static_cast<int16_t>(random());
    for (auto& t : v.transfer) t = static_cast<int8_t>(random());
    return v;
}

}  // namespace dimmer::test
