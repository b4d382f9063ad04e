#include <pipeline/fit.h>

#include <pipeline/settings.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

namespace dimmer::cook {
namespace {

// What is predicted leaves this much room: records of texels were up to 4 % more than charts' areas say on large
// levels, up to 18 % on one of two rooms; tetrahedra go almost with probes.
constexpr double density_margin = 0.92, probes_margin = 0.97;
constexpr uint32_t local_probes_least = 8;  // a gradient along each axis
constexpr double density_factor_max = 16;   // coarser pages are none
constexpr int density_steps_max = 14;       // of halving: to a thousandth
constexpr double error_max = 1;             // of thresholds: what costs more light than there is mends nothing

// One budget that is set: what it would hold at some rungs.
struct Limit {
    uint64_t budget;
    std::function<uint64_t(const RecordBytes&)> bytes;                               // of which texels have these
    std::function<uint64_t(const LossSteps&, uint32_t, uint8_t, uint8_t)> saved_by;  // group, from, to
};

bool gridIsOver(const PackCost& cost, const Profile& profile) {
    return profile.budget_global_grid > 0 && cost.global_grid > profile.budget_global_grid;
}

bool localGridsAreOver(const PackCost& cost, const Profile& profile) {
    return profile.budget_local_grids > 0 && cost.local_grids > profile.budget_local_grids;
}

double ratio(uint64_t a, uint64_t b) {
    return static_cast<double>(a) / static_cast<double>(std::max<uint64_t>(b, 1));
}

uint64_t scaled(uint64_t bytes, double share) {
    return static_cast<uint64_t>(std::llround(static_cast<double>(bytes) * share));
}

RecordBytes recordsNow(const LossTable& losses) {
    return losses.bytes(Rungs(losses.groupCount(), 0));
}

// Of all bytes of texels' records, the share that stays; what says where records belong goes with them.
double recordsLeft(const RecordBytes& now, const RecordBytes& then) {
    return now.dynamic > 0 ? ratio(then.dynamic, now.dynamic) : 1;
}

std::vector<Limit> limitsOf(const PackData& pack, const PackCost& cost, const Profile& profile,
                            const LossTable& losses) {
    std::vector<Limit> limits;
    const auto records = [](const LossSteps& steps, uint32_t g, uint8_t from, uint8_t to) {
        return steps.step(g, from, to).bytes;
    };
    const RecordBytes now = recordsNow(losses);
    const auto left = [&now](uint64_t bytes) {
        return [now, bytes](const RecordBytes& then) { return scaled(bytes, recordsLeft(now, then)); };
    };
    if (profile.budget_dynamic > 0) limits.push_back({profile.budget_dynamic, left(cost.dynamic), records});
    const uint64_t stays = cost.base_lightmap + cost.global_grid + cost.local_grids;
    if (profile.budget_total > 0)
        limits.push_back({profile.budget_total,
                          [stays, rest = left(cost.dynamic + cost.ancillary)](const RecordBytes& then) {
                              return stays + rest(then);
                          },
                          records});
    const auto first_door =
        static_cast<uint32_t>(std::ranges::count(pack.elements, ElementKind::LightSet, &Element::kind));
    for (const ElementCost& e : cost.elements) {
        if (profile.budget_per_element == 0) break;
        const auto saved_by = [e, first_door](const LossSteps& steps, uint32_t g, uint8_t from, uint8_t to) {
            if (e.element >= first_door) return steps.doorBytes(g, from, to, e.element - first_door);
            return g == 1 + e.element ? steps.step(g, from, to).bytes : uint64_t{0};
        };
        const auto of_element = [e, first_door](const RecordBytes& held) {
            const bool door = e.element >= first_door;
            const auto& all = door ? held.by_door : held.by_group;
            const size_t index = door ? e.element - first_door : 1 + e.element;
            return index < all.size() ? all[index] : uint64_t{0};
        };
        limits.push_back({profile.budget_per_element,
                          [of_element, e, before = of_element(now)](const RecordBytes& then) {
                              const uint64_t texels = e.bytes - e.probe_bytes, more = texels + of_element(then);
                              const uint64_t stay = more - std::min(more, before);
                              return stay + (texels > 0 ? scaled(e.probe_bytes, ratio(stay, texels)) : e.probe_bytes);
                          },
                          saved_by});
    }
    return limits;
}

const Limit* exceeded(const LossTable& losses, const std::vector<Limit>& limits, const Rungs& rungs) {
    if (limits.empty()) return nullptr;
    const RecordBytes then = losses.bytes(rungs);
    const auto it = std::ranges::find_if(limits, [&](const Limit& l) { return l.bytes(then) > l.budget; });
    return it == limits.end() ? nullptr : &*it;
}

constexpr const char* threshold_key = "records.threshold";

float thresholdOf(const PackData& pack, const Profile& profile, uint32_t group) {
    if (group == always_group) return profile.threshold;
    const auto own = profile.set_thresholds.find(pack.elements[group - 1].name);
    return own == profile.set_thresholds.end() ? profile.threshold : own->second;
}

Remedy byRungs(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
               const std::vector<Limit>& limits, const Rungs& rungs) {
    Remedy remedy;
    const Loss loss = losses.loss(rungs);
    const uint64_t now = losses.storedBytes(Rungs(losses.groupCount(), 0)), then = losses.storedBytes(rungs);
    remedy.saves = now - std::min(now, then) +
                   scaled(cost.probe_records, std::max(0.0, 1 - recordsLeft(recordsNow(losses), losses.bytes(rungs))));
    remedy.error = loss.error;
    remedy.energy = loss.energy;
    if (loss.energy > 0)
        remedy.energy_of = loss.energy_group == always_group
                               ? "what is always on, through doors"
                               : fmt::format("set '{}'", pack.elements[loss.energy_group - 1].name);
    remedy.fits =
        exceeded(losses, limits, rungs) == nullptr && !gridIsOver(cost, profile) && !localGridsAreOver(cost, profile);
    const auto raised = [&](uint32_t group) {
        const float from = thresholdOf(pack, profile, group);
        if (!(from > 0 && from < threshold_max)) return from;  // what is stored whole has no multiples
        return ladderOf(from)[rungs[group]];
    };
    // Always-on light goes by the threshold of all, which sets without one of their own go by too.
    const float of_all = rungs.empty() ? profile.threshold : raised(always_group);
    if (of_all != profile.threshold) remedy.changes.push_back({threshold_key, profile.threshold, of_all});
    for (uint32_t g = always_group + 1; g < rungs.size(); ++g) {
        const std::string& name = pack.elements[g - 1].name;
        const float from = thresholdOf(pack, profile, g), to = raised(g);
        if (to != (profile.set_thresholds.contains(name) ? from : of_all))
            remedy.changes.push_back({std::string(set_threshold_prefix) + name, from, to});
    }
    return remedy;
}

// Always the step that loses the least light for the bytes that the exceeded budget is over by.
Rungs greedy(const LossTable& losses, const std::vector<Limit>& limits) {
    Rungs rungs(losses.groupCount(), 0);
    LossSteps steps = losses.steps(rungs);
    while (const Limit* limit = exceeded(losses, limits, rungs)) {
        uint32_t best_group = 0;
        uint8_t best_rung = 0;
        double best = INFINITY;
        for (uint32_t g = 0; g < rungs.size(); ++g)
            for (auto r = static_cast<uint8_t>(rungs[g] + 1); r < threshold_rungs.size(); ++r) {
                const uint64_t saved = limit->saved_by(steps, g, rungs[g], r);
                const double price =
                    steps.step(g, rungs[g], r).error / static_cast<double>(std::max<uint64_t>(saved, 1));
                if (saved == 0 || !(price < best)) continue;
                best = price;
                best_group = g;
                best_rung = r;
            }
        if (best_rung == 0) break;
        rungs[best_group] = best_rung;
        if (losses.isLimited()) steps = losses.steps(rungs);
    }
    return rungs;
}

// The first rung at which everything fits, for one group or for all of them.
Rungs firstFitting(const LossTable& losses, const std::vector<Limit>& limits, uint32_t group) {
    Rungs rungs(losses.groupCount(), 0);
    for (uint8_t r = 1; r < threshold_rungs.size(); ++r) {
        for (uint32_t g = 0; g < rungs.size(); ++g)
            if (group == no_index || g == group) rungs[g] = r;
        if (!exceeded(losses, limits, rungs)) break;
    }
    return rungs;
}

// A budget that density helps with: what of it are pages, what goes with charts' texels, and what stays.
struct Share {
    uint64_t budget, pages, texels, stays;

    bool over() const { return budget > 0 && pages + texels + stays > budget; }
    // Whether it fits with a little to spare, or, with `power` above 1, with more.
    bool fitsWith(const LossTable::TexelsLeft& left, double power) const {
        if (budget <= stays) return false;
        const auto shrinking = static_cast<double>(pages + texels);
        const double wanted = std::pow(density_margin * static_cast<double>(budget - stays) / shrinking, power);
        return static_cast<double>(pages) * left.pages + static_cast<double>(texels) * left.charts <=
               wanted * shrinking;
    }
};

std::vector<Share> sharesOver(const PackCost& cost, const Profile& profile) {
    const uint64_t of_probes = cost.probe_records, of_texels = cost.dynamic - of_probes;
    std::vector<Share> shares = {
        {profile.budget_total, cost.base_lightmap, of_texels + cost.ancillary,
         cost.global_grid + cost.local_grids + of_probes},
        {profile.budget_base_lightmaps, cost.base_lightmap, 0, 0},
        {profile.budget_dynamic, 0, of_texels, of_probes},
    };
    for (const ElementCost& e : cost.elements)
        shares.push_back({profile.budget_per_element, 0, e.bytes - e.probe_bytes, e.probe_bytes});
    std::erase_if(shares, [](const Share& s) { return !s.over(); });
    return shares;
}

bool baseIsOver(const PackCost& cost, const Profile& profile) {
    return profile.budget_base_lightmaps > 0 && cost.base_lightmap > profile.budget_base_lightmaps;
}

bool pagesOrRecordsAreOver(const PackCost& cost, const Profile& profile) {
    return !sharesOver(cost, profile).empty();
}

// Saves nothing where no budget that it helps with is exceeded.
Remedy byDensity(const PackCost& cost, const Profile& profile, const LossTable& losses, size_t steps_before) {
    Remedy remedy;
    const std::vector<Share> over = sharesOver(cost, profile);
    if (over.empty()) return remedy;
    // Where two steps fell short already, go further than it takes.
    const double power = 1 + 0.5 * static_cast<double>(std::max<size_t>(steps_before, 1) - 1);
    const auto enough = [&](double factor) {
        const LossTable::TexelsLeft left = losses.texelsLeft(factor);
        return std::ranges::all_of(over, [&](const Share& s) { return s.fitsWith(left, power); });
    };
    double too_little = 1, factor = density_factor_max;
    if (const auto least = losses.texelsLeft(factor); least.pages >= 1 && least.charts >= 1) return remedy;
    remedy.fits = enough(factor) && !gridIsOver(cost, profile) && !localGridsAreOver(cost, profile);
    for (int step = 0; step < density_steps_max; ++step) {
        const double middle = std::sqrt(too_little * factor);
        (enough(middle) ? factor : too_little) = middle;
    }
    const float from = profile.texels_per_metre;
    const float to = std::max(0.01f, std::floor(from / static_cast<float>(factor) * 100) / 100);
    if (!(to < from)) return {};
    factor = static_cast<double>(from) / static_cast<double>(to);
    const LossTable::TexelsLeft left = losses.texelsLeft(factor);
    remedy.changes.push_back({density_key, from, to});
    remedy.error = losses.densityError(factor);
    remedy.saves = scaled(cost.base_lightmap, std::max(0.0, 1 - left.pages)) +
                   scaled(cost.dynamic - cost.probe_records + cost.ancillary, 1 - left.charts);
    return remedy;
}

uint64_t globalProbes(const PackData& pack) {
    return pack.probes.global.positions.size();
}

// Fewer probes, as bytes go with their number: `left` of them, a share.
Remedy withProbes(const PackData& pack, const PackCost& cost, const Profile& profile, double left) {
    Remedy remedy;
    constexpr uint64_t corners = 8;  // of the grid's box, which are probes too
    const uint64_t probes = globalProbes(pack);
    if (!(left < 1) || probes <= corners) return remedy;
    const auto to = static_cast<uint64_t>(probes_margin * std::max(left, 0.0) * static_cast<double>(probes));
    if (to <= corners) return remedy;
    remedy.changes.push_back(
        {"grids.probes_max", static_cast<float>(profile.probes_max), static_cast<float>(to - corners)});
    remedy.saves = scaled(cost.global_grid, 1 - ratio(to, probes));
    remedy.moves_light = true;
    remedy.texels = false;
    return remedy;
}

// Saves nothing where the grid is not the trouble. Where the total asks for more probes than can go, its excess is left
// to others.
Remedy byProbes(const PackData& pack, const PackCost& cost, const Profile& profile) {
    const double for_grid = gridIsOver(cost, profile) ? ratio(profile.budget_global_grid, cost.global_grid) : 1.0;
    double for_total = 1;
    if (profile.budget_total > 0 && cost.device() > profile.budget_total)
        for_total -= ratio(cost.device() - profile.budget_total, cost.global_grid + cost.probe_records);
    Profile others = profile;
    others.budget_total = others.budget_global_grid = 0;
    Remedy remedy = withProbes(pack, cost, profile, std::min(for_grid, for_total));
    if (remedy.changes.empty()) {
        remedy = withProbes(pack, cost, profile, for_grid);
        others.budget_total = profile.budget_total;
    }
    remedy.fits = !pagesOrRecordsAreOver(cost, others) && !localGridsAreOver(cost, profile);
    return remedy;
}

// Where the total is too much and a grid is a part of it: probes give their share, texels the rest.
Remedy byAll(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
             size_t density_steps) {
    if (profile.budget_total == 0 || cost.device() <= profile.budget_total) return {};
    const Remedy probes = withProbes(pack, cost, profile, ratio(profile.budget_total, cost.device()));
    if (probes.changes.empty()) return {};
    PackCost rest = cost;
    rest.global_grid -= probes.saves;
    Remedy both = byDensity(rest, profile, losses, density_steps);
    if (both.changes.empty()) both.fits = !pagesOrRecordsAreOver(rest, profile);
    both.texels = !both.changes.empty();
    both.changes.insert(both.changes.end(), probes.changes.begin(), probes.changes.end());
    both.saves += probes.saves;
    both.moves_light = true;
    return both;
}

// Fewer probes for the models that have most: the largest number at which all fit. A grid may end up below it, as
// whole planes of probes go.
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
    if (to >= profile.local_probes_max) return remedy;
    remedy.changes.push_back(
        {"grids.local_probes_max", static_cast<float>(profile.local_probes_max), static_cast<float>(to)});
    remedy.saves = cost.local_grids - std::min(cost.local_grids, bytesAt(to));
    Profile others = profile;
    others.budget_local_grids = 0;
    remedy.fits =
        bytesAt(to) <= profile.budget_local_grids && !pagesOrRecordsAreOver(cost, others) && !gridIsOver(cost, profile);
    remedy.moves_light = true;
    remedy.texels = false;
    return remedy;
}

uint32_t largestSet(const PackData& pack, const PackCost& cost) {
    const auto sets =
        std::span(cost.elements)
            .first(static_cast<size_t>(std::ranges::count(pack.elements, ElementKind::LightSet, &Element::kind)));
    return sets.empty() ? 0 : 1 + std::ranges::max_element(sets, {}, &ElementCost::bytes)->element;
}

// Whether the coarsest pages and the highest thresholds would fit, and, where probes may go too, no grids. As
// predicted, without a margin: what is in doubt is tried.
bool mayFit(const PackData& pack, PackCost cost, Profile profile, const LossTable& losses, bool without_grids) {
    const LossTable::TexelsLeft left = losses.texelsLeft(density_factor_max);
    if (without_grids) {
        cost.dynamic -= std::exchange(cost.probe_records, 0);
        cost.global_grid = cost.local_grids = 0;
        for (ElementCost& e : cost.elements) e.bytes -= std::exchange(e.probe_bytes, 0);
    }
    cost.base_lightmap = scaled(cost.base_lightmap, left.pages);
    cost.dynamic = scaled(cost.dynamic, left.charts);
    cost.ancillary = scaled(cost.ancillary, left.charts);
    profile.budget_per_element = scaled(profile.budget_per_element, 1 / left.charts);
    const Rungs highest(losses.groupCount(), static_cast<uint8_t>(threshold_rungs.size() - 1));
    return !baseIsOver(cost, profile) && !exceeded(losses, limitsOf(pack, cost, profile, losses), highest);
}

}  // namespace

std::vector<Remedy> remedies(const PackData& pack, const PackCost& cost, const Profile& profile,
                             const LossTable& losses) {
    const auto limits = limitsOf(pack, cost, profile, losses);
    std::vector<Remedy> found;
    const auto add = [&](Remedy remedy) {
        const auto same = [&](const Remedy& other) { return other.changes == remedy.changes; };
        if (remedy.saves == 0 || remedy.changes.empty() || remedy.error > error_max || std::ranges::any_of(found, same))
            return;
        found.push_back(std::move(remedy));
    };
    add(byDensity(cost, profile, losses, 0));
    add(byProbes(pack, cost, profile));
    add(byAll(pack, cost, profile, losses, 0));
    add(byLocalProbes(pack, cost, profile));
    if (!baseIsOver(cost, profile) && exceeded(losses, limits, Rungs(losses.groupCount(), 0))) {
        const auto by = [&](const Rungs& rungs) { add(byRungs(pack, cost, profile, losses, limits, rungs)); };
        by(greedy(losses, limits));
        by(firstFitting(losses, limits, no_index));
        if (const uint32_t largest = largestSet(pack, cost); largest > 0) by(firstFitting(losses, limits, largest));
    }
    found = withoutDominated(std::move(found));
    // What is not predicted comes last, but where nothing else helps.
    const bool grid_is_over = gridIsOver(cost, profile) || localGridsAreOver(cost, profile);
    std::ranges::stable_sort(
        found, {}, [&](const Remedy& r) { return std::tuple(!r.fits, r.moves_light != grid_is_over, r.error); });
    return found;
}

Remedy fittingRemedy(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
                     size_t density_steps) {
    if (!mayFit(pack, cost, profile, losses, true)) return {};
    const auto limits = limitsOf(pack, cost, profile, losses);
    if (gridIsOver(cost, profile)) return byProbes(pack, cost, profile);
    if (localGridsAreOver(cost, profile)) return byLocalProbes(pack, cost, profile);
    if (!baseIsOver(cost, profile)) {
        Remedy thresholds = byRungs(pack, cost, profile, losses, limits, greedy(losses, limits));
        if (thresholds.fits && !thresholds.changes.empty()) return thresholds;
    }
    Remedy remedy = byAll(pack, cost, profile, losses, density_steps);
    const bool takes_probes = !remedy.changes.empty();
    if (!takes_probes) remedy = byDensity(cost, profile, losses, density_steps);
    if (!remedy.fits)
        if (Remedy probes = byProbes(pack, cost, profile); probes.fits && !probes.changes.empty()) return probes;
    return takes_probes || mayFit(pack, cost, profile, losses, false) ? remedy : Remedy{};
}

}  // namespace dimmer::cook
