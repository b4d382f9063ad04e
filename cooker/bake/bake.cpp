#include <bake/bake.h>

#include <bake/denoise.h>
#include <bake/door_pairs.h>
#include <bake/final_gather.h>
#include <bake/group_light.h>
#include <bake/series.h>
#include <bake/sharpen.h>
#include <models/scene_models.h>
#include <probes/grid_bake.h>
#include <probes/local_bake.h>

#include <algorithm>
#include <atomic>
#include <functional>

namespace dimmer::cook {
namespace {

Sparse<ReceiverLight> gatherAll(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                                std::span<const uint8_t> groups, Progress& progress, uint64_t& rays, RayEnds* ends) {
    const size_t receivers = gatherer.texels().size();
    progress.stage("final gather", receivers);
    const std::vector<float> floors = noiseFloors(series, gatherer.paths().groupCount());
    const FinalGatherOptions options = finalGatherOptions(settings, floors);
    std::atomic<uint64_t> all_traced = 0;
    const bool remembers = ends && ends->rows() == 0;
    if (remembers)
        *ends = RayEnds(receivers, static_cast<uint32_t>(gatherer.receiverCount()), gatherer.paths().pathCount());
    const RayEnds* known = remembers ? nullptr : ends;
    auto light = Sparse<ReceiverLight>::build(receivers, [&](size_t begin, size_t end, auto emit) {
        FinalGather<Gathered> gather(gatherer);
        std::vector<ReceiverLight> row;
        std::vector<SamplePoint> points;
        std::vector<uint32_t> terms, of_group, bounced;
        RowEnds own_ends;
        if (ends) own_ends.kept_max = ends->keptMax();
        std::vector<RowEnds> all_ends;
        uint64_t traced = 0;
        for (size_t i = begin; i < end; ++i) {
            series.activeTerms(i, terms);
            std::erase_if(terms, [&](uint32_t t) { return !groups[gatherer.paths().terms()[t].group]; });
            bounced.clear();
            for (const TermLight& l : series.bounced.row(i))
                if (luminance(l.value()) > 0) bounced.push_back(l.term);
            row.clear();
            own_ends.clear();
            if (known && !terms.empty()) known->get(i, own_ends);
            if (!settings.per_set_passes)
                traced += gather.gather(gatherer.at(i, points), terms, series.radiance, options, row,
                                        ends ? &own_ends : nullptr, bounced);
            if (remembers) all_ends.push_back(own_ends);
            for (uint32_t g = 0; settings.per_set_passes && g < gatherer.paths().groupCount(); ++g) {
                of_group.clear();
                std::ranges::copy_if(terms, std::back_inserter(of_group),
                                     [&](uint32_t t) { return gatherer.paths().group(t) == g; });
                if (of_group.empty()) continue;
                traced +=
                    gather.gather(gatherer.at(i, points), of_group, series.radiance, options, row, nullptr, bounced);
            }
            if (settings.per_set_passes) std::ranges::sort(row, {}, &ReceiverLight::term);
            // Neighbours' light may end at a wall that the chart runs under.
            std::erase_if(row, [&](const ReceiverLight& l) {
                const auto lit = series.direct.row(i);
                return l.term != always_group && l.light.irradiance_lux == glm::vec3(0) &&
                       std::ranges::find(lit, l.term, term_of) == lit.end();
            });
            for (ReceiverLight& l : row) l.keep = series.keepUpTo(i, l.term);
            emit(std::span<const ReceiverLight>(row));
        }
        if (remembers) ends->putBlock(begin / rows_per_block, all_ends);
        all_traced += traced;
        progress.advance(end - begin);
    });
    rays += all_traced;
    return light;
}

// Direct light of fully baked lamps joins after the filters: it has no noise, and its shadows have edges, beside which
// sharpening would leave bright and dark lines.
void addDirect(const Sparse<ReceiverLight>& direct, const DoorPaths& paths, Sparse<ReceiverLight>& light) {
    if (direct.entryCount() == 0) return;
    light.forEachRow([&](size_t i, std::span<ReceiverLight> row) {
        for (const ReceiverLight& d : direct.row(i)) {
            auto at = row.end();
            for (uint32_t t = d.term; at == row.end() && t != no_term; t = paths.lessClosed(t))
                at = std::ranges::find(row, t, &ReceiverLight::term);
            if (at != row.end()) at->light += d.light;
        }
    });
}

// Which light groups are to be baked, and which are followed only as far as the global grid needs them.
struct Turns {
    std::vector<uint8_t> bake, follow;
};

// What is left of the series for the global grid.
struct FollowedLight {
    SparseLight radiance;
    std::vector<uint32_t> bounces;  // per group
};

// Fills `baked` with the light of the groups whose turn it is, as it arrives. `rays`: may be null.
Series gatherGroups(const Gatherer& gatherer, const LightGrid& lights, const BakeSettings& settings, const Turns& turns,
                    Progress& progress, RememberedRays* rays, Baked& baked) {
    RayEnds* const links = rays ? &rays->links : nullptr;
    Series series = expandSeries(gatherer, lights, settings, progress, turns.follow, links);
    baked.rays = series.rays;
    if (std::ranges::count(turns.bake, 1) > 0) {
        baked.door_flux = doorFlux(gatherer, lights, series, settings, turns.bake, progress, links);
        baked.light =
            gatherAll(gatherer, series, settings, turns.bake, progress, baked.rays, rays ? &rays->gather : nullptr);
        baked.local_light = bakeLocalGrids(gatherer, lights, series, settings, turns.bake, progress, baked.rays);
    }
    return series;
}

// Makes what gatherGroups() left in `baked` what lightmaps are to hold.
FollowedLight finishTexels(const Gatherer& gatherer, Series series, const BakeSettings& settings, Progress& progress,
                           Baked& baked) {
    baked.reports = std::move(series.reports);
    const Sparse<ReceiverLight> direct = std::move(series.stored_direct);
    FollowedLight followed{std::move(series.radiance), std::move(series.bounces)};
    series = {};
    if (settings.denoise)
        baked.light = denoise(gatherer.rays(), gatherer.unwrap(), gatherer.texels(), std::move(baked.light), progress);
    if (settings.sharpen)
        baked.light = sharpen({gatherer.unwrap(), gatherer.texels()}, std::move(baked.light), progress);
    addDirect(direct, gatherer.paths(), baked.light);
    for (size_t i = 0; i < baked.light.rows(); ++i)
        for (const ReceiverLight& l : baked.light.row(i)) ++baked.reports[l.term].receivers;
    baked.bounces = std::ranges::max(followed.bounces);
    return followed;
}

// A bake step by step: what a store has need not be made.
class Bake {
   public:
    Bake(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const BakeSettings& settings,
         Progress& progress, GroupStore* store)
        : rays_(rays),
          unwrap_(unwrap),
          texels_(texels),
          settings_(settings),
          progress_(progress),
          store_(store),
          paths_(rays.scene(), doorsInSight(rays)),
          groups_(paths_.groupCount()),
          found_(groups_),
          radiance_(groups_) {
        turns_ = {std::vector<uint8_t>(groups_, 1), std::vector<uint8_t>(groups_, 1)};
    }

    Baked run() {
        findGroups();
        baked_.terms = paths_.terms();
        baked_.reports.resize(paths_.termCount());
        baked_.door_flux.resize(groups_);
        baked_.light = Sparse<ReceiverLight>::Builder(texels_.size()).finish();
        if (settings_.grid.probes_max > 0) findGrid();
        if (std::ranges::count(turns_.follow, 1) > 0) followGroups();
        addGroups(found_, paths_, baked_);
        warnOfLocalGrids();
        if (sites_) makeGrid();
        for (const auto* probes : {&baked_.grid.light, &baked_.local_light})
            for (size_t i = 0; i < probes->rows(); ++i)
                for (const ProbeTermLight& l : probes->row(i)) ++baked_.reports[l.term].receivers;
        baked_.dependent_doors = dependentDoors(baked_.door_flux, settings_);
        if (baked_.bounces == settings_.bounces_max)
            baked_.warnings.push_back(
                "the bounces had not died down after as many as the quality's 'bounces' allow; some light is missing "
                "(walls that reflect nearly all of it make it last)");
        return std::move(baked_);
    }

   private:
    void findGroups() {
        size_t probes = 0;
        for (const LocalGrid& grid : localGrids(rays_.scene(), 0)) probes += grid.probeCount();
        baked_.local_light = Sparse<ProbeTermLight>::Builder(probes).finish();
        for (uint32_t g = 0; store_ && g < groups_; ++g) {
            found_[g] = store_->find(g);
            if (found_[g] && !cook::fits(*found_[g], paths_, g, texels_.size(), probes)) found_[g].reset();
            turns_.bake[g] = !found_[g];
        }
        turns_.follow = turns_.bake;
    }

    // The grid as it was, or what of it must be made anew; groups of which it asks for light at new places are followed
    // again, unless the store has what their surfaces send out.
    void findGrid() {
        if (store_)
            if (auto grid = store_->findGrid(); grid && fits(*grid)) {
                baked_.grid = std::move(*grid);
                return;
            }
        auto choice = chooseSites(rays_, settings_.grid, store_);
        if (!choice) return warnOfNoGrid(choice.error());
        choice_ = std::move(*choice);
        sites_.emplace(choice_.blocks, paths_, store_);
        const auto asked = sites_->asked();
        for (uint32_t g = 0; store_ && g < groups_; ++g) {
            if (turns_.follow[g] || !asked[g]) continue;
            radiance_[g] = store_->findRadiance(g);
            if (radiance_[g] && !cook::fits(*radiance_[g], gatherer().receiverCount(), paths_.termsOf(g).size()))
                radiance_[g].reset();
            if (!radiance_[g]) turns_.follow[g] = 1;
        }
    }

    bool fits(const BakedGrid& baked) const {
        const size_t probes = baked.grid.positions.size();
        return cook::fits(baked.light, probes, paths_.termCount()) &&
               std::ranges::all_of(baked.grid.tetrahedra, [&](const auto& t) {
                   return std::ranges::all_of(t.probes, [&](uint32_t p) { return p < probes; });
               });
    }

    const Gatherer& gatherer() {
        if (!gatherer_) {
            emitters_.emplace(rays_, meshGroups(rays_.scene()));
            gatherer_.emplace(rays_, unwrap_, texels_, *emitters_, paths_);
        }
        return *gatherer_;
    }

    // Of the groups that are followed or asked for at sites.
    const LightGrid& lights() {
        if (!lights_) {
            gatherer();  // first, or progress would count it to the lamps' rays
            std::vector<uint8_t> groups = turns_.follow;
            if (sites_) std::ranges::transform(groups, sites_->asked(), groups.begin(), std::logical_or());
            lights_.emplace(rays_, settings_.light_grid, groups, &progress_);
        }
        return *lights_;
    }

    void followGroups() {
        const bool remembers = store_ && !settings_.per_set_passes;
        RememberedRays rays;
        if (remembers) findRays(rays);
        const bool fresh_links = rays.links.rows() == 0, fresh_gather = rays.gather.rows() == 0;
        // Only where every receiver is gathered from are there rays from all of them.
        const bool all = turns_.bake[always_group];
        Series series =
            gatherGroups(gatherer(), lights(), settings_, turns_, progress_, remembers ? &rays : nullptr, baked_);
        if (remembers && fresh_links) store_->keepRays("links", {}, rays.links);
        if (remembers && fresh_gather && all) store_->keepRays("gather", {}, rays.gather);
        rays = {};
        followed_ = finishTexels(gatherer(), std::move(series), settings_, progress_, baked_);
        for (uint32_t g = 0; store_ && g < groups_; ++g) {
            if (turns_.bake[g]) store_->keep(g, lightOfGroup(baked_, paths_, g, followed_.bounces[g]));
            if (turns_.follow[g] && settings_.grid.probes_max > 0)
                store_->keepRadiance(g, radianceOfGroup(followed_.radiance, paths_, g));
        }
    }

    void findRays(RememberedRays& rays) {
        const auto receivers = static_cast<uint32_t>(gatherer().receiverCount());
        const uint32_t paths = paths_.pathCount();
        if (auto links = store_->findRays("links", {}, receivers, receivers, paths)) rays.links = std::move(*links);
        if (auto ends = store_->findRays("gather", {}, texels_.size(), receivers, paths))
            rays.gather = std::move(*ends);
    }

    void makeGrid() {
        if (std::ranges::count(sites_->asked(), 1) > 0) {
            addRadiance(radiance_, paths_, followed_.radiance);
            baked_.rays +=
                sites_->trace(gatherer(), lights(), followed_.radiance, baked_.reports, settings_, progress_);
        }
        followed_ = {};
        auto grid = bakeGrid(rays_, choice_, sites_->take(), paths_.terms(), settings_.grid, progress_);
        if (!grid) return warnOfNoGrid(grid.error());
        baked_.grid = std::move(*grid);
        if (store_) store_->keepGrid(baked_.grid);
    }

    void warnOfLocalGrids() {
        if (std::ranges::all_of(rays_.scene().models, &SceneModel::moves)) return;
        auto found = gatherer_ ? warningsOfLocalGrids(rays_, gatherer_->models().places())
                               : warningsOfLocalGrids(rays_, probePlaces(rays_));
        std::ranges::move(found, std::back_inserter(baked_.warnings));
    }

    void warnOfNoGrid(const Error& error) { baked_.warnings.push_back("no global grid: " + error.message); }

    const RayScene& rays_;
    const Unwrap& unwrap_;
    const Texels& texels_;
    const BakeSettings& settings_;
    Progress& progress_;
    GroupStore* store_;
    const DoorPaths paths_;
    const uint32_t groups_;
    std::vector<std::optional<GroupLight>> found_;
    std::vector<std::optional<SparseLight>> radiance_;  // of groups that are not followed again
    Turns turns_;
    FollowedLight followed_;
    SiteChoice choice_;
    std::optional<SiteLight> sites_;  // of the grid, where it is to be made
    std::optional<EmitterSampler> emitters_;
    std::optional<Gatherer> gatherer_;
    std::optional<LightGrid> lights_;
    Baked baked_;
};

}  // namespace

Baked bake(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const BakeSettings& settings,
           Progress& progress, GroupStore* store) {
    return Bake(rays, unwrap, texels, settings, progress, store).run();
}

}  // namespace dimmer::cook
