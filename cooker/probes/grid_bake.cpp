#include <probes/grid_bake.h>

#include <bake/sampling.h>
#include <probes/placement.h>
#include <probes/probe_gather.h>
#include <probes/tetrahedra.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

constexpr uint32_t probe_seed = 0x9b05688cu;

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
        ProbeGather gather(sites, series, settings);
        uint64_t traced = 0;
        for (size_t i = range.begin(); i < range.end(); ++i)
            if (placed->sources[i] == i)
                traced += gather.gather(vec(placed->grid.positions[i]), probe_seed + static_cast<uint32_t>(i),
                                        around[i], {}, no_model, rows[i]);
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
