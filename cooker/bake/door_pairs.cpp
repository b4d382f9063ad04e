#include <bake/door_pairs.h>

#include <bake/series.h>

#include <algorithm>
#include <map>
#include <set>

namespace dimmer::cook {
namespace {

constexpr uint32_t measuring_rays = 8;

using Pair = std::pair<uint32_t, uint32_t>;

BakeSettings few(BakeSettings settings) {
    settings.series_rays = std::min(settings.series_rays, measuring_rays);
    settings.emitter_samples = 1;
    return settings;
}

Series seriesOf(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const DoorPaths& paths,
                const BakeSettings& settings, Progress& progress) {
    const EmitterSampler emitters(rays, meshGroups(rays.scene()));
    const Gatherer gatherer(rays, unwrap, texels, emitters, paths);
    return expandSeries(gatherer, settings, progress);
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

std::vector<DoorPair> dependentDoors(const RayScene& rays, const Unwrap& unwrap, const Texels& texels,
                                     const BakeSettings& settings, float loss_min, Progress& progress) {
    if (rays.scene().doors.size() < 2) return {};
    const BakeSettings cheap = few(settings);
    Scene named = rays.scene();
    const auto pairs =
        seenTogether(named, seriesOf(rays, unwrap, texels, DoorPaths(named), cheap, progress).doors_seen);
    if (pairs.empty()) return {};
    for (const Pair& pair : pairs) named.combinations.push_back({{true, pair.first}, {true, pair.second}});
    const DoorPaths paths(named);
    const Series series = seriesOf(rays, unwrap, texels, paths, cheap, progress);

    std::vector<double> alone(named.doors.size());
    std::map<Pair, double> together;
    for (uint32_t t = 0; t < paths.termCount(); ++t) {
        const auto doors = doorsOf(paths.terms()[t]);
        if (doors.size() == 1) alone[doors[0]] += series.reports[t].energy;
        if (doors.size() == 2) together[{doors[0], doors[1]}] += series.reports[t].energy;
    }
    std::vector<DoorPair> found;
    for (const Pair& pair : pairs) {
        const double less = std::min(alone[pair.first], alone[pair.second]);
        const auto loss = static_cast<float>(less > 0 ? together[pair] / less : 0);
        if (loss > loss_min) found.push_back({pair.first, pair.second, loss});
    }
    std::ranges::stable_sort(found, std::greater{}, &DoorPair::loss);
    return found;
}

}  // namespace dimmer::cook
