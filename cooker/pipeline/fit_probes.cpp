#include <pipeline/fit_ways.h>

namespace dimmer::cook {
namespace {

constexpr double probes_margin = 0.97;      // tetrahedra go almost with probes
constexpr uint64_t corners = 8;             // of the grid's box, which are probes too
constexpr uint32_t local_probes_least = 8;  // a gradient along each axis

}  // namespace

PackCost withProbesLeft(PackCost cost, double left) {
    const uint64_t records = cost.probe_records;
    cost.global_grid = scaledBytes(cost.global_grid, left);
    cost.probe_records = scaledBytes(records, left);
    cost.dynamic -= records - cost.probe_records;
    for (ElementCost& e : cost.elements) {
        const uint64_t before = e.probe_bytes;
        e.probe_bytes = scaledBytes(before, left);
        e.bytes -= before - e.probe_bytes;
    }
    return cost;
}

double leastProbesLeft(const PackData& pack) {
    const auto probes = static_cast<double>(std::max<size_t>(1, pack.probes.global.positions.size()));
    return std::min(1.0, (static_cast<double>(corners) + 1.01) / (probes_margin * probes));
}

Remedy toProbes(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
                double left) {
    Remedy remedy;
    const uint64_t probes = pack.probes.global.positions.size();
    if (!(left < 1) || probes <= corners) return remedy;
    const auto to = static_cast<uint64_t>(probes_margin * std::max(left, 0.0) * static_cast<double>(probes));
    if (to <= corners) return remedy;
    remedy.changes.push_back(
        {"grids.probes_max", static_cast<float>(profile.probes_max), static_cast<float>(to - corners)});
    remedy.saves = cost.device() - withProbesLeft(cost, ratio(to, probes)).device();
    remedy.moves_light = true;
    remedy.grid_error = losses.probesError(ratio(to, probes));
    remedy.texels = false;
    return remedy;
}

// Where the total asks for more probes than can go, its excess is left to others.
Remedy byProbes(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses) {
    const double for_grid = gridIsOver(cost, profile) ? ratio(profile.budget_global_grid, cost.global_grid) : 1.0;
    double for_total = 1;
    if (isOver(cost.device(), profile.budget_total))
        for_total -= ratio(cost.device() - profile.budget_total, cost.global_grid + cost.probe_records);
    Profile others = profile;
    others.budget_total = others.budget_global_grid = 0;
    Remedy remedy = toProbes(pack, cost, profile, losses, std::min(for_grid, for_total));
    if (remedy.changes.empty()) {
        remedy = toProbes(pack, cost, profile, losses, for_grid);
        others.budget_total = profile.budget_total;
    }
    remedy.fits = !pagesOrRecordsAreOver(cost, others) && !localGridsAreOver(cost, profile);
    return remedy;
}

// A grid may end up below that number, as whole planes of probes go.
Remedy byLocalProbes(const PackData& pack, const PackCost& cost, const Profile& profile) {
    Remedy remedy;
    if (!localGridsAreOver(cost, profile)) return remedy;
    const auto bytesAt = [&](uint32_t most) {
        uint64_t probes = 0;
        for (const LocalGrid& grid : pack.probes.local) probes += std::min<uint64_t>(grid.probeCount(), most);
        return probes * sizeof(ProbeRecord);
    };
    uint32_t to = local_probes_least;
    while (to < profile.local_probes_max && bytesAt(to + 1) <= profile.budget_local_grids) ++to;
    remedy.saves = cost.local_grids - std::min(cost.local_grids, bytesAt(to));
    if (to >= profile.local_probes_max || remedy.saves == 0) return {};
    remedy.changes.push_back(
        {"grids.local_probes_max", static_cast<float>(profile.local_probes_max), static_cast<float>(to)});
    Profile others = profile;
    others.budget_local_grids = 0;
    remedy.fits =
        bytesAt(to) <= profile.budget_local_grids && !pagesOrRecordsAreOver(cost, others) && !gridIsOver(cost, profile);
    remedy.moves_light = true;
    remedy.texels = false;
    return remedy;
}

}  // namespace dimmer::cook
