#include <probes/grid_bake.h>

#include <bake/final_gather.h>
#include <bake/sampling.h>
#include <probes/placement.h>
#include <probes/tetrahedra.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

// Rays go all around, and there are few probes: more of them than a texel gets.
constexpr uint32_t rays_per_texel_ray = 4;
constexpr uint32_t probe_seed = 0x9b05688cu;

class GridGather {
   public:
    GridGather(const Sites& sites, const Series& series, const BakeSettings& settings)
        : sites_(sites),
          gatherer_(sites.gatherer()),
          series_(series),
          settings_(settings),
          floors_(noiseFloors(series)),
          options_(finalGatherOptions(settings, floors_)),
          final_(gatherer_),
          sum_(gatherer_.paths().termCount()),
          direct_(gatherer_.paths().termCount()),
          stored_(gatherer_.paths().termCount()) {
        options_.rays_max *= rays_per_texel_ray;
    }

    // `wanted`: terms to gather besides those that are active at the probe itself, ascending.
    uint64_t gather(glm::vec3 position_m, uint32_t number, std::span<const uint32_t> wanted,
                    std::vector<ProbeTermLight>& row) {
        const SamplePoint point{position_m, no_face};
        const GatherFrom from = Gatherer::atProbe(point, probe_seed + number);
        findActive(from, wanted);
        row.clear();
        const uint64_t traced = final_.gather(from, active_, series_.radiance, options_, row);
        for (ProbeTermLight& l : row)
            if (const auto touched = stored_.touched(); std::ranges::binary_search(touched, l.term))
                l.light += stored_[l.term];
        stored_.clear();
        return traced + settings_.series_rays;
    }

   private:
    // As for texels: lit straight, or by as much as the term's threshold asks.
    void findActive(const GatherFrom& from, std::span<const uint32_t> wanted) {
        sites_.directAt(from, direct_, stored_);
        gatherer_.gather(from,
                         {.rays = settings_.series_rays,
                          .emitter_samples = settings_.emitter_samples,
                          .seed = settings_.seed,
                          .wanted_in_group = {}},
                         &series_.radiance, sum_, nullptr);
        active_.assign(wanted.begin(), wanted.end());
        active_.push_back(always_group);
        for (auto* light : {&direct_, &sum_}) {
            for (const uint32_t t : light->touched()) {
                const float lux = luminance((*light)[t].irradiance());
                if (t != always_group && series_.active(t, 0, lux)) active_.push_back(t);
            }
            light->clear();
        }
        std::ranges::sort(active_);
        active_.erase(std::unique(active_.begin(), active_.end()), active_.end());
    }

    const Sites& sites_;
    const Gatherer& gatherer_;
    const Series& series_;
    const BakeSettings& settings_;
    std::vector<float> floors_;
    FinalGatherOptions options_;
    FinalGather<ProbeLight> final_;
    TermAccumulator<ProbeLight> sum_, direct_, stored_;
    std::vector<uint32_t> active_;
};

// A term that is active where a probe has so large a share belongs to the probe too.
constexpr float share_that_counts = 0.1f;

// Per position, ascending.
std::vector<std::vector<uint32_t>> termsAround(const Placement& placed) {
    std::vector<std::vector<uint32_t>> terms(placed.sources.size());
    for (size_t s = 0; s < placed.sites.size(); ++s)
        for (size_t k = 0; k < 4; ++k)
            if (placed.sites[s].shares[k] >= share_that_counts)
                for (const ProbeTermLight& l : placed.light[s].terms)
                    terms[placed.sites[s].probes[k]].push_back(l.term);
    for (auto& list : terms) {
        std::ranges::sort(list);
        list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    return terms;
}

// One term over the probes that have it and the sites where they count.
class TermFit {
   public:
    explicit TermFit(const Placement& placed) : placed_(placed), number_(placed.sources.size(), no_probe) {}

    void fit(uint32_t term, std::vector<std::vector<ProbeTermLight>>& rows) {
        std::vector<ProbeTermLight*> members;
        for (uint32_t i = 0; i < rows.size(); ++i) {
            const auto found = std::ranges::find(rows[i], term, &ProbeTermLight::term);
            number_[i] = found == rows[i].end() ? no_probe : static_cast<uint32_t>(members.size());
            if (found != rows[i].end()) members.push_back(&*found);
        }
        std::vector<FitValue> probes;
        for (const ProbeTermLight* l : members) probes.push_back(valueOf(l->light));
        chooseSites(term);
        fitProbes(sites_, targets_, probes);
        for (size_t i = 0; i < members.size(); ++i)
            for (size_t k = 0; k < 27; ++k) members[i]->light.radiance[k / 3][static_cast<int>(k % 3)] = probes[i][k];
    }

   private:
    static FitValue valueOf(const ProbeLight& light) {
        FitValue value;
        for (size_t k = 0; k < 27; ++k) value[k] = light.radiance[k / 3][static_cast<int>(k % 3)];
        return value;
    }

    // Those with a probe of the term; where it is not active it is as good as dark.
    void chooseSites(uint32_t term) {
        sites_.clear();
        targets_.clear();
        for (size_t s = 0; s < placed_.sites.size(); ++s) {
            FitSite site = placed_.sites[s];
            float known = 0;
            for (size_t k = 0; k < 4; ++k) {
                const uint32_t number = number_[site.probes[k]];
                if (number == no_probe) site.shares[k] = 0;
                site.probes[k] = number == no_probe ? 0 : number;
                known += site.shares[k];
            }
            if (!(known > 0)) continue;
            const auto& terms = placed_.light[s].terms;
            const auto found = std::ranges::find(terms, term, &ProbeTermLight::term);
            targets_.push_back(found == terms.end() ? FitValue{} : valueOf(found->light));
            sites_.push_back(site);
        }
        decideImportance();
    }

    // As placement has it, of the term's own light.
    void decideImportance() {
        constexpr float floor_of_mean = 0.1f;
        const auto lightOf = [&](size_t s) { return luminance({targets_[s][0], targets_[s][1], targets_[s][2]}); };
        double sum = 0;
        for (size_t s = 0; s < sites_.size(); ++s) sum += static_cast<double>(lightOf(s));
        const auto floor = floor_of_mean * static_cast<float>(sum / static_cast<double>(sites_.size())) + 1e-12f;
        for (size_t s = 0; s < sites_.size(); ++s) {
            const float light = lightOf(s) + floor;
            sites_[s].importance = floor / light;
        }
    }

    const Placement& placed_;
    std::vector<uint32_t> number_;  // per position, among the probes of the term
    std::vector<FitSite> sites_;
    std::vector<FitValue> targets_;
};

}  // namespace

Expected<void> bakeGrid(const Gatherer& gatherer, const Series& series, const BakeSettings& settings,
                        Progress& progress, Baked& out) {
    if (settings.grid.probes_max == 0) return {};
    const Sites sites(gatherer, series, settings);
    auto placed = placeProbes(sites, settings.grid, progress);
    if (!placed) return std::unexpected(placed.error());
    const size_t probes = placed->grid.positions.size();
    progress.stage("probes", probes);
    const auto around = termsAround(*placed);
    std::atomic<uint64_t> rays = 0;
    // Blocks of rows are large for so few receivers, so each row is made on its own.
    std::vector<std::vector<ProbeTermLight>> rows(probes);
    tbb::parallel_for(tbb::blocked_range<size_t>(0, probes, 16), [&](const auto& range) {
        GridGather gather(sites, series, settings);
        uint64_t traced = 0;
        for (size_t i = range.begin(); i < range.end(); ++i)
            if (placed->sources[i] == i)
                traced += gather.gather(vec(placed->grid.positions[i]), static_cast<uint32_t>(i), around[i], rows[i]);
        rays += traced;
        progress.advance(range.size());
    });
    if (settings.grid.fit)
        tbb::parallel_for(0u, gatherer.paths().termCount(), [&](uint32_t t) { TermFit(*placed).fit(t, rows); });
    out.grid.light = Sparse<ProbeTermLight>::build(probes, [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) emit(std::span<const ProbeTermLight>(rows[placed->sources[i]]));
    });
    out.grid.grid = std::move(placed->grid);
    out.grid.free_volume_m3 = placed->free_volume_m3;
    out.rays += rays + sites.raysTraced();
    return {};
}

}  // namespace dimmer::cook
