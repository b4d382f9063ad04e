// What the host pays for an update: planning on a pack like UBERBAKE's ESTATE, 132 light sets, no device involved.
//   build/bin/dimmer_update_bench
#include <dimmer/light_state.h>
#include <synth/synth.h>
#include <update/planner.h>

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <map>

namespace dimmer::cook {
namespace {

const PackData& estate(uint32_t clusters) {
    static std::map<uint32_t, PackData> packs;
    const auto found = packs.find(clusters);
    if (found != packs.end()) return found->second;
    auto made = synthesise({.level = *productionLevel("estate"), .clusters = clusters});
    if (!made) std::abort();
    return packs.emplace(clusters, std::move(*made)).first->second;
}

// `changed` of the sets differ from frame to frame; the rest are set again to what they were, as games do.
void plan(benchmark::State& state) {
    const PackData& data = estate(static_cast<uint32_t>(state.range(0)));
    const auto changed = static_cast<uint32_t>(state.range(1));
    Planner planner(data);
    planner.plan();
    uint32_t frame = 0;
    for (auto _ : state) {
        const float weight = ++frame % 2 ? 0.5f : 1.0f;
        for (uint32_t i = 0; i < data.elements.size(); ++i) planner.setElement(i, i < changed ? weight : 1.0f);
        benchmark::DoNotOptimize(planner.plan());
    }
    state.counters["batches"] = planner.stats().batches;
}
BENCHMARK(plan)
    ->ArgNames({"clusters", "changed"})
    ->ArgsProduct({{1000, 10000}, {0, 1, 5, 132}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dimmer::cook

BENCHMARK_MAIN();
