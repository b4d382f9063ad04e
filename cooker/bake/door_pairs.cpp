#include <bake/door_pairs.h>

#include <bake/series.h>

#include <algorithm>
#include <map>
#include <set>

namespace dimmer::cook {
namespace {

// The flux over a whole level is measured: so many rays in all, within limits per texel.
constexpr size_t measuring_rays = 200'000;
constexpr size_t texel_rays_min = 4, texel_rays_max = 16;

using Pair = std::pair<uint32_t, uint32_t>;

BakeSettings few(BakeSettings settings, size_t texels) {
    const size_t rays = std::clamp(measuring_rays / texels, texel_rays_min, texel_rays_max);
    settings.series_rays = std::min(settings.series_rays, static_cast<uint32_t>(rays));
    settings.emitter_samples = 1;
    return settings;
}

bool covered(const Scene& scene, const Pair& pair) {
    return std::ranges::any_of(scene.combinations, [&](const std::vector<ElementRef>& combination) {
        const auto names = [&](uint32_t door) {
            return std::ranges::any_of(combination, [&](const ElementRef& e) { return e.is_door && e.index == door; });
        };
        const bool any_set = std::ranges::any_of(combination, [](const ElementRef& e) { return !e.is_door; });
        return !any_set && names(pair.first) && names(pair.second);
    });
}

std::set<Pair> seenTogether(const Scene& scene, const Sparse<uint32_t>& doors_seen) {
    std::set<Pair> pairs;
    for (size_t i = 0; i < doors_seen.rows(); ++i) {
        const auto row = doors_seen.row(i);  // ascending
        for (size_t a = 0; a < row.size(); ++a)
            for (size_t b = a + 1; b < row.size(); ++b) pairs.insert({row[a], row[b]});
    }
    std::erase_if(pairs, [&](const Pair& pair) { return covered(scene, pair); });
    return pairs;
}

// The doors that a term is about, ascending.
std::vector<uint32_t> doorsOf(const Term& term) {
    std::vector<uint32_t> doors;
    std::ranges::merge(term.doors_open, term.doors_closed, std::back_inserter(doors));
    return doors;
}

}  // namespace

std::vector<DoorPair> dependentDoors(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                                     Progress& progress) {
    Scene named = gatherer.rays().scene();
    const auto pairs = seenTogether(named, series.doors_seen);
    if (pairs.empty()) return {};
    for (const Pair& pair : pairs) named.combinations.push_back({{true, pair.first}, {true, pair.second}});
    const DoorPaths paths(named);
    const Gatherer keeping_pairs(gatherer.rays(), gatherer.unwrap(), gatherer.texels(), gatherer.emitters(), paths);
    const Series measured = expandSeries(keeping_pairs, few(settings, gatherer.texels().size()), progress);

    std::vector<double> alone(named.doors.size());
    std::map<Pair, double> together;
    for (uint32_t t = 0; t < paths.termCount(); ++t) {
        const auto doors = doorsOf(paths.terms()[t]);
        if (doors.size() == 1) alone[doors[0]] += measured.reports[t].energy;
        if (doors.size() == 2) together[{doors[0], doors[1]}] += measured.reports[t].energy;
    }
    std::vector<DoorPair> found;
    for (const Pair& pair : pairs) {
        const double less = std::min(alone[pair.first], alone[pair.second]);
        const auto loss = static_cast<float>(less > 0 ? together[pair] / less : 0);
        if (loss > settings.threshold) found.push_back({pair.first, pair.second, loss});
    }
    std::ranges::stable_sort(found, std::greater{}, &DoorPair::loss);
    return found;
}

}  // namespace dimmer::cook
