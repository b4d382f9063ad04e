#include <probes/local_bake.h>

#include <probes/probe_gather.h>

#include <fmt/format.h>

#include <atomic>

namespace dimmer::cook {
namespace {

constexpr uint32_t local_probe_seed = 0x1f83d9abu;

// Models of which no probe is in the open.
void warnOfBuried(const Gatherer& gatherer, std::vector<std::string>& warnings) {
    const ModelReceivers& models = gatherer.models();
    uint32_t last = no_model;
    for (uint32_t i = 0; i < models.places().source.size(); ++i) {
        const uint32_t model = models.modelOfProbe(i);
        if (models.places().source[i] != no_index || model == last) continue;
        last = model;
        warnings.push_back(fmt::format("node '{}': stands inside of other geometry; its light grid is black",
                                       gatherer.rays().scene().models[model].node));
    }
}

}  // namespace

Sparse<ProbeTermLight> bakeLocalGrids(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                                      std::span<const uint8_t> groups, Progress& progress, uint64_t& rays,
                                      std::vector<std::string>& warnings) {
    const ProbePlaces& places = gatherer.models().places();
    const size_t probes = places.position_m.size();
    std::vector<std::vector<ProbeTermLight>> rows(probes);
    if (probes > 0) {
        progress.stage("local grids", probes);
        const LightGrid lights(gatherer.rays(), settings.light_grid);
        std::atomic<uint64_t> all_traced = 0;
        tbb::parallel_for(tbb::blocked_range<size_t>(0, probes, 8), [&](const auto& range) {
            ProbeGather gather(gatherer, lights, series, settings);
            uint64_t traced = 0;
            for (size_t i = range.begin(); i < range.end(); ++i) {
                const auto number = static_cast<uint32_t>(i);
                if (places.source[i] != i) continue;
                traced += gather.gather(places.position_m[i], local_probe_seed + number, groups,
                                        gatherer.models().modelOfProbe(number), rows[i]);
            }
            all_traced += traced;
            progress.advance(range.size());
        });
        rays += all_traced;
        warnOfBuried(gatherer, warnings);
    }
    return Sparse<ProbeTermLight>::build(probes, [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) {
            if (places.source[i] == no_index)
                emit(std::span<const ProbeTermLight>{});
            else
                emit(std::span<const ProbeTermLight>(rows[places.source[i]]));
        }
    });
}

}  // namespace dimmer::cook
