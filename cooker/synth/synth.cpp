#include <synth/synth.h>

#include <probes/tetrahedra.h>
#include <synth/regions.h>

#include <fmt/format.h>
#include <format/texel.h>
#include <pack/batches.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

namespace dimmer::cook {
namespace {

constexpr std::array<LevelStatistics, 5> levels = {{
    {"estate", 2637824, 50805, 229725, 132, 0, 28, 77},
    {"consulate", 3276800, 32783, 229250, 61, 0, 32, 61},
    {"townhoused", 4194304, 16524, 151408, 24, 1, 37, 50},
    {"safehouse", 2363392, 77110, 232617, 14, 3, 27, 41},
    {"yard", 2097152, 32183, 135209, 6, 0, 12, 27},
}};

constexpr uint32_t page_width = 2048, page_height_max = 2048;
constexpr uint32_t overlap_max = 16;  // UBERBAKE's own limit

// 0.01 to 100 lux per contribution in a level whose largest sum is near 1,600: the format's range is in use, and the
// largest sum (16 contributions and the base) stays below 65024.
constexpr float exposure = 32;

float uniform(SynthRandom& random, float low, float high) {
    return low + (high - low) * (static_cast<float>(random() >> 8) * 0x1p-24f);
}

TexelRecord randomRecord(ColorFormat format, SynthRandom& random) {
    const float stored = std::exp2(uniform(random, -6.6f, 6.6f)) * exposure;
    const float r = uniform(random, 0.2f, 1), z = uniform(random, 0.3f, 1), angle = uniform(random, 0, 6.2831853f);
    const float across = std::sqrt(1 - z * z) / z * (1 - r);
    const float green = stored * uniform(random, 0.6f, 1), blue = stored * uniform(random, 0.3f, 1);
    return {encodeColor(format, stored, green, blue),
            encodeDirection(1, r, across * std::cos(angle), across * std::sin(angle))};
}

void addPages(const SynthOptions& options, PackData& pack) {
    const auto texels = static_cast<uint32_t>(std::llround(options.level.texels * options.scale));
    const uint32_t rows = (texels + page_width - 1) / page_width;
    pack.page_width = page_width;
    pack.page_count = (rows + page_height_max - 1) / page_height_max;
    pack.page_height = (rows + pack.page_count - 1) / pack.page_count;
    pack.exposure = exposure;
    pack.color_format = options.color_format;
}

void addElements(const SynthOptions& options, PackData& pack) {
    const uint32_t sets = options.light_sets ? options.light_sets : options.level.light_sets;
    for (uint32_t i = 0; i < sets; ++i) {
        pack.elements.push_back({fmt::format("set{}", i), ElementKind::LightSet, 1});
        pack.contributions.push_back({i, {}, {}, 0, 0});
    }
    for (uint32_t i = 0; i < options.level.doors; ++i) {
        pack.elements.push_back({fmt::format("door{}", i), ElementKind::Door, 1});
        pack.contributions.push_back({std::nullopt, {sets + i}, {}, 0, 0});
    }
}

// The receivers of each region, along the 8x8 tiles of the pages, as the cooker orders them.
std::vector<std::vector<uint32_t>> addressesOf(const Regions& regions, const PackData& pack) {
    std::vector<std::vector<uint32_t>> result(regions.count());
    for (uint32_t page = 0; page < pack.page_count; ++page)
        for (uint32_t ty = 0; ty < pack.page_height; ty += 8)
            for (uint32_t tx = 0; tx < pack.page_width; tx += 8)
                for (uint32_t i = 0; i < 64; ++i) {
                    const uint32_t x = tx + i % 8, y = ty + i / 8;
                    if (y < pack.page_height)
                        result[regions.at(x, page * pack.page_height + y)].push_back(TexelAddress::pack(page, x, y));
                }
    return result;
}

void addCluster(const std::vector<uint32_t>& contributions, std::span<const uint32_t> addresses, PackData& pack) {
    const auto count = static_cast<uint32_t>(addresses.size());
    Cluster cluster{.first_receiver = static_cast<uint32_t>(pack.addresses.size()),
                    .receiver_count = count,
                    .first_batch = static_cast<uint32_t>(pack.batches.size()),
                    .batch_count = 0,
                    .first_term = static_cast<uint32_t>(pack.terms.size()),
                    .term_count = static_cast<uint32_t>(contributions.size())};
    for (uint32_t k : contributions) {
        pack.terms.push_back({k, pack.contributions[k].receivers});  // within the contribution, for now
        pack.contributions[k].receivers += count;
    }
    pack.addresses.insert(pack.addresses.end(), addresses.begin(), addresses.end());
    cutIntoBatches(pack.addresses, pack.page_width, cluster.first_receiver, pack.batches);
    cluster.batch_count = static_cast<uint32_t>(pack.batches.size()) - cluster.first_batch;
    pack.clusters.push_back(cluster);
}

// Clusters by their number of contributions, as the cooker orders them.
std::vector<uint32_t> byOverlap(const std::vector<std::vector<uint32_t>>& members) {
    std::vector<uint32_t> order(members.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](uint32_t i) { return members[i].size(); });
    return order;
}

void addRecords(SynthRandom& random, PackData& pack) {
    std::vector<uint32_t> first(1, 0);
    for (const Contribution& c : pack.contributions) first.push_back(first.back() + c.receivers);
    for (ClusterTerm& term : pack.terms) term.first_record += first[term.contribution];
    pack.payload.resize(first.back());
    for (TexelRecord& record : pack.payload) record = randomRecord(pack.color_format, random);
    pack.base_pages.resize(size_t{pack.page_count} * pack.page_height * pack.page_width);
    for (TexelRecord& record : pack.base_pages) record = randomRecord(pack.color_format, random);
}

ProbeRecord randomProbe(ColorFormat format, SynthRandom& random) {
    ProbeRecord probe{.light = randomRecord(format, random).irradiance, .bands = {}};
    for (uint32_t& word : probe.bands) word = static_cast<uint32_t>(random()) & 0x3f3f3f3fu;  // 0..63 of 127
    return probe;
}

// Each cluster of texels has its share of the probes, with the same contributions.
void addProbes(const SynthOptions& options, SynthRandom& random, PackData& pack) {
    ProbeData& probes = pack.probes;
    const double count = (options.level.local_probes + options.level.global_probes) * options.scale;
    probes.base.resize(static_cast<size_t>(std::llround(count)));
    for (ProbeRecord& probe : probes.base) probe = randomProbe(pack.color_format, random);
    probes.record_counts.assign(pack.contributions.size(), 0);
    const double share = count / static_cast<double>(pack.base_pages.size());
    double due = 0;
    for (const Cluster& texels : pack.clusters) {
        due += share * texels.receiver_count;
        const auto receivers = static_cast<uint32_t>(due) - static_cast<uint32_t>(probes.numbers.size());
        if (receivers == 0) continue;
        Cluster cluster{.first_receiver = static_cast<uint32_t>(probes.numbers.size()),
                        .receiver_count = receivers,
                        .first_batch = static_cast<uint32_t>(probes.batches.size()),
                        .batch_count = (receivers + batch_receivers_max - 1) / batch_receivers_max,
                        .first_term = static_cast<uint32_t>(probes.terms.size()),
                        .term_count = texels.term_count};
        for (uint32_t first = 0; first < receivers; first += batch_receivers_max)
            probes.batches.push_back(
                {cluster.first_receiver + first, std::min(batch_receivers_max, receivers - first)});
        for (uint32_t t = texels.first_term; t < texels.first_term + texels.term_count; ++t) {
            uint32_t& records = probes.record_counts[pack.terms[t].contribution];
            probes.terms.push_back({pack.terms[t].contribution, records});
            records += receivers;
        }
        for (uint32_t i = 0; i < receivers; ++i) probes.numbers.push_back(cluster.first_receiver + i);
        probes.clusters.push_back(cluster);
    }
    std::vector<uint32_t> first(1, 0);
    for (const uint32_t records : probes.record_counts) first.push_back(first.back() + records);
    for (ClusterTerm& term : probes.terms) term.first_record += first[term.contribution];
    probes.payload.resize(first.back());
    for (ProbeRecord& record : probes.payload) record = randomProbe(pack.color_format, random);
}

constexpr uint32_t storeys = 6;  // layers of the global grid: levels are wider than high

// Of the probes, in the order of their numbers: a jittered lattice of 1 m in storeys, and the corners of the box.
Expected<GlobalGrid> randomGrid(size_t probes, SynthRandom& random) {
    const size_t inside = probes - std::min<size_t>(probes, 8);
    const auto side = std::max<size_t>(1, static_cast<size_t>(std::sqrt(static_cast<double>(inside) / storeys)));
    std::vector<glm::vec3> points(inside);
    glm::vec3 size(0);
    for (size_t i = 0; i < inside; ++i) {
        const glm::vec3 cell(i % side, i / side % storeys, i / side / storeys);
        points[i] =
            cell + glm::vec3{uniform(random, -0.4f, 0.4f), uniform(random, -0.4f, 0.4f), uniform(random, -0.4f, 0.4f)};
        size = glm::max(size, cell);
    }
    return tetrahedralise(points, {glm::vec3(0), size});
}

// Models that stand about, with 3 x 2 x 3 probes each; what is left over is one in a row.
void addLocalGrids(PackData& pack, SynthRandom& random) {
    const auto end = static_cast<uint32_t>(pack.probes.base.size());
    const StartGrid& box = pack.probes.global.start;
    for (auto first = static_cast<uint32_t>(pack.probes.global.positions.size()); first < end;) {
        LocalGrid grid{
            .node = fmt::format("model{}", pack.probes.local.size()), .first_probe = first, .counts = {3, 2, 3}};
        if (end - first < grid.probeCount()) grid.counts = {end - first, 1, 1};
        for (size_t axis = 0; axis < 3; ++axis) {
            grid.origin_m[axis] = uniform(random, box.min_m[axis], box.max_m[axis]);
            grid.step_m[axis][axis] = 1;
        }
        first += static_cast<uint32_t>(grid.probeCount());
        pack.probes.local.push_back(std::move(grid));
    }
}

Expected<void> addGrids(const SynthOptions& options, SynthRandom& random, PackData& pack) {
    auto grid = randomGrid(static_cast<size_t>(std::llround(options.level.global_probes * options.scale)), random);
    if (!grid) return std::unexpected(grid.error());
    pack.probes.global = std::move(*grid);
    addLocalGrids(pack, random);
    return {};
}

std::string settingsOf(const SynthOptions& options) {
    const auto entry = [](const auto& value) {
        return nlohmann::ordered_json{{"value", value}, {"from", "command line"}};
    };
    return nlohmann::ordered_json{{"synth.like", entry(std::string(options.level.name))},
                                  {"synth.scale", entry(options.scale)},
                                  {"synth.clusters", entry(options.clusters)},
                                  {"synth.sets", entry(options.light_sets)},
                                  {"synth.probes", entry(options.probes)},
                                  {"synth.seed", entry(options.seed)}}
        .dump();
}

Expected<void> check(const SynthOptions& options) {
    if (!(options.scale >= 1.0 / 64 && options.scale <= 64))
        return fail(ErrorCode::InvalidArgument, fmt::format("The scale {} is not within 1/64..64.", options.scale));
    if (options.clusters == 0 || options.clusters > 100000)
        return fail(ErrorCode::InvalidArgument, fmt::format("{} clusters are not within 1..100000.", options.clusters));
    if (options.light_sets > 4096)
        return fail(ErrorCode::InvalidArgument, fmt::format("{} light sets are more than 4096.", options.light_sets));
    return {};
}

}  // namespace

double LevelStatistics::meanOverlap() const {
    const double record_bytes = 8.0 * texels + 28.0 * (local_probes + global_probes);
    return (memory_with_sets_mib - memory_mib) * 0x1p20 / record_bytes;
}

std::span<const LevelStatistics> productionLevels() {
    return levels;
}

std::optional<LevelStatistics> productionLevel(std::string_view name) {
    const auto found = std::ranges::find(levels, name, &LevelStatistics::name);
    return found == levels.end() ? std::nullopt : std::optional(*found);
}

Expected<PackData> synthesise(const SynthOptions& options) {
    if (auto ok = check(options); !ok) return std::unexpected(ok.error());
    PackData pack;
    addPages(options, pack);
    addElements(options, pack);

    SynthRandom random(options.seed);
    const double mean = options.level.meanOverlap();
    const auto contributions = static_cast<uint32_t>(pack.contributions.size());
    // A share 1 / (1 + mean) of geometrically distributed overlaps is 0: those regions come on top.
    const auto region_count = static_cast<uint32_t>(std::ceil(options.clusters * (1 + mean) / mean));
    const Regions regions(page_width, pack.page_count * pack.page_height, region_count, random);
    const auto addresses = addressesOf(regions, pack);
    std::vector<uint32_t> sizes;
    for (const auto& list : addresses) sizes.push_back(static_cast<uint32_t>(list.size()));
    const auto overlaps = fitOverlaps(sizes, mean, options.clusters, std::min(overlap_max, contributions), random);
    const auto members = nearestContributions(regions, overlaps, contributions, random);
    for (uint32_t i : byOverlap(members)) {
        if (members[i].empty()) continue;
        for (auto left = std::span(addresses[i]); !left.empty();) {
            const size_t count = countOnPage(left);
            addCluster(members[i], left.first(count), pack);
            left = left.subspan(count);
        }
    }
    addRecords(random, pack);
    if (options.probes) {
        addProbes(options, random, pack);
        if (auto ok = addGrids(options, random, pack); !ok) return std::unexpected(ok.error());
    }
    pack.settings_json = settingsOf(options);
    return pack;
}

}  // namespace dimmer::cook
