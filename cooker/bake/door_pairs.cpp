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

std::vector<DoorFlux> doorFlux(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                               std::span<const uint8_t> groups, Progress& progress, RayEnds* links) {
    Scene named = gatherer.rays().scene();
    const auto pairs = seenTogether(named, series.doors_seen);
    std::vector<DoorFlux> flux(groups.size());
    if (pairs.empty()) return flux;
    for (const Pair& pair : pairs) named.combinations.push_back({{true, pair.first}, {true, pair.second}});
    const DoorPaths paths(named);
    const Gatherer keeping_pairs(gatherer.rays(), gatherer.unwrap(), gatherer.texels(), gatherer.emitters(), paths);
    const Series measured =
        expandSeries(keeping_pairs, few(settings, gatherer.texels().size()), progress, groups, links);

    for (DoorFlux& f : flux) {
        f.alone.resize(named.doors.size());
        for (const Pair& pair : pairs) f.pairs.push_back({pair.first, pair.second, 0});
    }
    for (uint32_t t = 0; t < paths.termCount(); ++t) {
        const auto doors = doorsOf(paths.terms()[t]);
        DoorFlux& f = flux[paths.terms()[t].group];
        if (doors.size() == 1) f.alone[doors[0]] += measured.reports[t].energy;
        if (doors.size() != 2) continue;
        const auto pair = pairs.find({doors[0], doors[1]});
        if (pair != pairs.end())
            f.pairs[static_cast<size_t>(std::distance(pairs.begin(), pair))].flux += measured.reports[t].energy;
    }
    return flux;
}

std::vector<DoorPair> dependentDoors(std::span<const DoorFlux> flux, const BakeSettings& settings) {
    const auto sum = [&](auto&& of_group) {
        double all = 0;
        for (size_t g = 0; g < flux.size(); ++g)
            all += (settings.group_brightness.empty() ? 1.0 : static_cast<double>(settings.group_brightness[g])) *
                   of_group(flux[g]);
        return all;
    };
    std::vector<DoorPair> found;
    for (size_t p = 0; !flux.empty() && p < flux[0].pairs.size(); ++p) {
        const uint32_t first = flux[0].pairs[p].first, second = flux[0].pairs[p].second;
        const auto alone = [&](uint32_t door) { return sum([&](const DoorFlux& f) { return f.alone[door]; }); };
        const double less = std::min(alone(first), alone(second));
        const double together = sum([&](const DoorFlux& f) { return f.pairs[p].flux; });
        const auto loss = static_cast<float>(less > 0 ? together / less : 0);
        if (loss > settings.threshold) found.push_back({first, second, loss});
    }
    std::ranges::stable_sort(found, std::greater{}, &DoorPair::loss);
    return found;
}

}  // namespace dimmer::cook
