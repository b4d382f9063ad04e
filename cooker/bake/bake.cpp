#include <bake/bake.h>

#include <bake/denoise.h>
#include <bake/door_pairs.h>
#include <bake/final_gather.h>
#include <bake/group_light.h>
#include <bake/series.h>
#include <probes/grid_bake.h>
#include <probes/local_bake.h>

#include <atomic>

namespace dimmer::cook {
namespace {

Sparse<ReceiverLight> gatherAll(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                                std::span<const uint8_t> groups, Progress& progress, uint64_t& rays) {
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
            std::erase_if(terms, [&](uint32_t t) { return !groups[gatherer.paths().terms()[t].group]; });
            row.clear();
            if (!settings.per_set_passes) traced += gather.gather(gatherer.at(i), terms, series.radiance, options, row);
            for (size_t t = 0; settings.per_set_passes && t < terms.size(); ++t)
                traced += gather.gather(gatherer.at(i), {&terms[t], 1}, series.radiance, options, row);
            for (ReceiverLight& l : row) l.keep = series.keepUpTo(i, l.term);
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

// Fills `baked` with the light of the groups whose turn it is, and with the global grid, which needs the bounces of all
// groups. Returns the bounces per group.
std::vector<uint32_t> bakeGroups(const Gatherer& gatherer, const BakeSettings& settings,
                                 std::span<const uint8_t> groups, Progress& progress, Baked& baked) {
    const std::vector<uint8_t> all(groups.size(), 1);
    const bool with_grid = settings.grid.probes_max > 0;
    Series series = expandSeries(gatherer, settings, progress, with_grid ? all : groups);
    baked.rays = series.rays;
    baked.door_flux = doorFlux(gatherer, series, settings, groups, progress);
    baked.light = gatherAll(gatherer, series, settings, groups, progress, baked.rays);
    baked.local_light = bakeLocalGrids(gatherer, series, settings, groups, progress, baked.rays, baked.warnings);
    if (with_grid)
        if (auto grid = bakeGrid(gatherer, series, settings, progress, baked); !grid)
            baked.warnings.push_back("no global grid: " + grid.error().message);
    baked.reports = std::move(series.reports);
    const Sparse<ReceiverLight> direct = std::move(series.stored_direct);
    std::vector<uint32_t> bounces = std::move(series.bounces);
    series = {};
    if (settings.denoise) baked.light = denoise(gatherer.unwrap(), gatherer.texels(), std::move(baked.light), progress);
    baked.light = withDirect(baked.light, direct);
    for (size_t i = 0; i < baked.light.rows(); ++i)
        for (const ReceiverLight& l : baked.light.row(i)) ++baked.reports[l.term].receivers;
    baked.bounces = std::ranges::max(bounces);
    return bounces;
}

}  // namespace

Baked bake(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const BakeSettings& settings,
           Progress& progress, GroupStore* store) {
    const DoorPaths paths(rays.scene());
    std::vector<std::optional<GroupLight>> found(paths.groupCount());
    std::vector<uint8_t> missing(paths.groupCount(), 1);
    for (uint32_t g = 0; store && g < paths.groupCount(); ++g)
        if (found[g] = store->find(g); found[g]) missing[g] = 0;
    Baked baked;
    baked.terms = paths.terms();
    baked.reports.resize(paths.termCount());
    baked.door_flux.resize(paths.groupCount());
    if (settings.grid.probes_max > 0 || std::ranges::count(missing, 1) > 0) {
        const EmitterSampler emitters(rays, meshGroups(rays.scene()));
        const Gatherer gatherer(rays, unwrap, texels, emitters, paths);
        const std::vector<uint32_t> bounces = bakeGroups(gatherer, settings, missing, progress, baked);
        for (uint32_t g = 0; store && g < paths.groupCount(); ++g)
            if (missing[g]) store->keep(g, lightOfGroup(baked, g, bounces[g]));
    } else {
        baked.light = Sparse<ReceiverLight>::Builder(texels.size()).finish();
        baked.local_light = Sparse<ProbeTermLight>::Builder(found[always_group]->local_light.rows()).finish();
    }
    addGroups(found, baked);
    for (const auto* probes : {&baked.grid.light, &baked.local_light})
        for (size_t i = 0; i < probes->rows(); ++i)
            for (const ProbeTermLight& l : probes->row(i)) ++baked.reports[l.term].receivers;
    baked.dependent_doors = dependentDoors(baked.door_flux, settings);
    if (baked.bounces == settings.bounces_max)
        baked.warnings.push_back("the bounces had not died down at bounces_max; some light is missing");
    return baked;
}

}  // namespace dimmer::cook
