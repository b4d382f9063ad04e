#include <pipeline/fit.h>
#include <pipeline/fit_ways.h>

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

namespace dimmer::cook {
namespace {

constexpr double error_max = 1;  // what costs more light than there is mends nothing

// Shares of the global grid's probes that are tried together with thresholds or density.
constexpr std::array probes_left = {1.0, 0.75, 0.5, 0.375, 0.25, 0.1875, 0.125, 0.0625};

// Thresholds leave all else as it is: density goes down instead where that saves so much of the error.
constexpr double density_gain_min = 0.01;

// Surfaces and what moves count alike.
double lossOf(const Remedy& remedy) {
    return remedy.error + remedy.grid_error.value_or(0);
}

Remedy both(Remedy a, const Remedy& b) {
    a.texels = !a.changes.empty();
    a.changes.insert(a.changes.end(), b.changes.begin(), b.changes.end());
    a.saves += b.saves;
    a.moves_light = b.moves_light;
    a.grid_error = b.grid_error;
    return a;
}

// With this share of the probes: what brings the rest within its budgets at the least loss.
Remedy withProbes(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
                  double left, size_t density_steps) {
    const Remedy probes = toProbes(pack, cost, profile, losses, left);
    if (left < 1 && probes.changes.empty()) return {};
    const PackCost rest = withProbesLeft(cost, left);
    Remedy best;
    best.fits = !pagesOrRecordsAreOver(rest, profile);
    if (!best.fits) {
        best = byThresholds(pack, rest, profile, losses);
        Remedy density = byDensity(rest, profile, losses, density_steps);
        const bool better = density.fits && (!best.fits || density.error + density_gain_min < best.error);
        if (!density.changes.empty() && (better || best.changes.empty())) best = std::move(density);
        if (best.changes.empty()) return {};
    }
    return left < 1 ? both(std::move(best), probes) : best;
}

// Thresholds or density with as many probes as lose the least in all. Where it is not known what fewer of them lose,
// they go where the rest does not fit without.
Remedy byAll(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
             size_t density_steps) {
    Remedy best;
    if (gridIsOver(cost, profile) || !pagesOrRecordsAreOver(cost, profile)) return best;
    for (const double left : probes_left) {
        Remedy remedy = withProbes(pack, cost, profile, losses, left, density_steps);
        if (remedy.changes.empty() || !remedy.fits || remedy.error > error_max) continue;
        const bool known = left == 1 || remedy.grid_error;
        if (best.changes.empty() || (known && lossOf(remedy) < lossOf(best))) best = std::move(remedy);
    }
    return best;
}

// Probes give the share that is asked of all, or as many as can go, and density what it can.
Remedy byShares(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
                size_t density_steps) {
    if (profile.budget_total == 0 || cost.device() <= profile.budget_total) return {};
    const double left = std::max(ratio(profile.budget_total, cost.device()), leastProbesLeft(pack));
    const Remedy probes = toProbes(pack, cost, profile, losses, left);
    if (probes.changes.empty()) return {};
    const PackCost rest = withProbesLeft(cost, left);
    Remedy density = byDensity(rest, profile, losses, density_steps);
    if (density.changes.empty()) density.fits = !pagesOrRecordsAreOver(rest, profile);
    return both(std::move(density), probes);
}

// Whether the coarsest pages and the highest thresholds would fit, and, where probes may go too, no grids. As
// predicted, without a margin: what is in doubt is tried.
bool mayFit(const PackData& pack, PackCost cost, Profile profile, const LossTable& losses, bool without_grids) {
    const LossTable::TexelsLeft left = losses.texelsLeft(density_factor_max);
    if (without_grids) {
        cost = withProbesLeft(cost, 0);
        cost.local_grids = 0;
    }
    cost.base_lightmap = scaledBytes(cost.base_lightmap, left.pages);
    cost.dynamic = scaledBytes(cost.dynamic, left.charts);
    cost.ancillary = scaledBytes(cost.ancillary, left.charts);
    profile.budget_per_element = scaledBytes(profile.budget_per_element, 1 / left.charts);
    return !baseIsOver(cost, profile) && fitsAtHighestThresholds(pack, cost, profile, losses);
}

}  // namespace

std::vector<Remedy> remedies(const PackData& pack, const PackCost& cost, const Profile& profile,
                             const LossTable& losses) {
    std::vector<Remedy> found;
    const auto add = [&](Remedy remedy) {
        const auto same = [&](const Remedy& other) { return other.changes == remedy.changes; };
        if (remedy.saves == 0 || remedy.changes.empty() || remedy.error > error_max || std::ranges::any_of(found, same))
            return;
        found.push_back(std::move(remedy));
    };
    add(byAll(pack, cost, profile, losses, 0));
    add(byDensity(cost, profile, losses, 0));
    add(byProbes(pack, cost, profile, losses));
    add(byShares(pack, cost, profile, losses, 0));
    add(byLocalProbes(pack, cost, profile));
    add(byThresholds(pack, cost, profile, losses));
    add(byThresholdOfAll(pack, cost, profile, losses));
    add(byLargestSet(pack, cost, profile, losses));
    found = withoutDominated(std::move(found));
    // What is not predicted comes last, but where nothing else helps.
    const bool grid_is_over = gridIsOver(cost, profile) || localGridsAreOver(cost, profile);
    std::ranges::stable_sort(found, {}, [&](const Remedy& r) {
        const bool unknown = r.moves_light && !r.grid_error;
        return std::tuple(!r.fits, grid_is_over ? !r.moves_light : unknown, lossOf(r));
    });
    return found;
}

Remedy fittingRemedy(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
                     size_t density_steps) {
    if (!mayFit(pack, cost, profile, losses, true)) return {};
    if (gridIsOver(cost, profile)) return byProbes(pack, cost, profile, losses);
    if (localGridsAreOver(cost, profile)) return byLocalProbes(pack, cost, profile);
    if (Remedy all = byAll(pack, cost, profile, losses, density_steps); !all.changes.empty()) return all;
    // Nothing is foretold to be enough: as far as it goes, and on from there.
    if (Remedy probes = byProbes(pack, cost, profile, losses); probes.fits && !probes.changes.empty()) return probes;
    if (Remedy shares = byShares(pack, cost, profile, losses, density_steps); !shares.changes.empty()) return shares;
    return mayFit(pack, cost, profile, losses, false) ? byDensity(cost, profile, losses, density_steps) : Remedy{};
}

}  // namespace dimmer::cook
