#include <bake/bake.h>

#include <bake/denoise.h>
#include <bake/door_pairs.h>
#include <bake/final_gather.h>
#include <bake/series.h>
#include <probes/grid_bake.h>

#include <atomic>

namespace dimmer::cook {
namespace {

Sparse<ReceiverLight> gatherAll(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                                Progress& progress, uint64_t& rays) {
    const size_t receivers = gatherer.texels().size();
    progress.stage("final gather", receivers);
    const std::vector<float> floors = noiseFloors(series);
    const FinalGatherOptions options = finalGatherOptions(settings, floors);
    std::atomic<uint64_t> all_traced = 0;
    auto light = Sparse<ReceiverLight>::build(receivers, [&](size_t begin, size_t end, auto emit) {
        FinalGather<Gathered> gather(gatherer);
        std::vector<ReceiverLight> row;
        std::vector<uint32_t> terms;
        uint64_t traced = 0;
        for (size_t i = begin; i < end; ++i) {
            series.activeTerms(i, terms);
            row.clear();
            if (!settings.per_set_passes) traced += gather.gather(gatherer.at(i), terms, series.radiance, options, row);
            for (size_t t = 0; settings.per_set_passes && t < terms.size(); ++t)
                traced += gather.gather(gatherer.at(i), {&terms[t], 1}, series.radiance, options, row);
            emit(std::span<const ReceiverLight>(row));
        }
        all_traced += traced;
        progress.advance(end - begin);
    });
    rays += all_traced;
    return light;
}

// Direct light of fully baked lamps joins after the filter: it has no noise, and shadows have edges.
Sparse<ReceiverLight> withDirect(const Sparse<ReceiverLight>& gathered, const Sparse<ReceiverLight>& direct) {
    return Sparse<ReceiverLight>::build(gathered.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<ReceiverLight> row;
        for (size_t i = begin; i < end; ++i) {
            const auto indirect = gathered.row(i);
            row.assign(indirect.begin(), indirect.end());
            for (const ReceiverLight& d : direct.row(i))
                for (ReceiverLight& l : row)
                    if (l.term == d.term) l.light += d.light;
            emit(std::span<const ReceiverLight>(row));
        }
    });
}

}  // namespace

Baked bake(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const BakeSettings& settings,
           Progress& progress) {
    const EmitterSampler emitters(rays, meshGroups(rays.scene()));
    const DoorPaths paths(rays.scene());
    const Gatherer gatherer(rays, unwrap, texels, emitters, paths);
    Series series = expandSeries(gatherer, settings, progress);
    Baked out;
    out.rays = series.rays;
    out.dependent_doors = dependentDoors(gatherer, series, settings, progress);
    out.light = gatherAll(gatherer, series, settings, progress, out.rays);
    out.terms = paths.terms();
    out.reports = series.reports;
    out.bounces = series.bounces;
    out.warnings = std::move(series.warnings);
    const Sparse<ReceiverLight> direct = std::move(series.stored_direct);
    const Expected<void> grid = bakeGrid(gatherer, series, settings, progress, out);
    if (!grid) out.warnings.push_back("no global grid: " + grid.error().message);
    series = {};
    if (settings.denoise) out.light = denoise(unwrap, texels, std::move(out.light), progress);
    out.light = withDirect(out.light, direct);
    for (size_t i = 0; i < texels.size(); ++i)
        for (const ReceiverLight& l : out.light.row(i)) ++out.reports[l.term].receivers;
    return out;
}

}  // namespace dimmer::cook
