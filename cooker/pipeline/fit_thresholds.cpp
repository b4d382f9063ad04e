#include <pipeline/fit_ways.h>
#include <pipeline/settings.h>

#include <fmt/format.h>

#include <functional>

namespace dimmer::cook {
namespace {

// One budget that is set: what it would hold at some rungs.
struct Limit {
    uint64_t budget;
    std::function<uint64_t(const RecordBytes&)> bytes;                               // of which texels have these
    std::function<uint64_t(const LossSteps&, uint32_t, uint8_t, uint8_t)> saved_by;  // group, from, to
};

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
        return [now, bytes](const RecordBytes& then) { return scaledBytes(bytes, recordsLeft(now, then)); };
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
                              return stay +
                                     (texels > 0 ? scaledBytes(e.probe_bytes, ratio(stay, texels)) : e.probe_bytes);
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
    remedy.saves =
        now - std::min(now, then) +
        scaledBytes(cost.probe_records, std::max(0.0, 1 - recordsLeft(recordsNow(losses), losses.bytes(rungs))));
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

uint32_t largestSet(const PackData& pack, const PackCost& cost) {
    const auto sets =
        std::span(cost.elements)
            .first(static_cast<size_t>(std::ranges::count(pack.elements, ElementKind::LightSet, &Element::kind)));
    return sets.empty() ? 0 : 1 + std::ranges::max_element(sets, {}, &ElementCost::bytes)->element;
}

bool nothingForThresholds(const PackCost& cost, const Profile& profile, const LossTable& losses,
                          const std::vector<Limit>& limits) {
    return baseIsOver(cost, profile) || !exceeded(losses, limits, Rungs(losses.groupCount(), 0));
}

}  // namespace

Remedy byThresholds(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses) {
    const auto limits = limitsOf(pack, cost, profile, losses);
    if (nothingForThresholds(cost, profile, losses, limits)) return {};
    return byRungs(pack, cost, profile, losses, limits, greedy(losses, limits));
}

Remedy byThresholdOfAll(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses) {
    const auto limits = limitsOf(pack, cost, profile, losses);
    if (nothingForThresholds(cost, profile, losses, limits)) return {};
    return byRungs(pack, cost, profile, losses, limits, firstFitting(losses, limits, no_index));
}

Remedy byLargestSet(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses) {
    const auto limits = limitsOf(pack, cost, profile, losses);
    const uint32_t largest = largestSet(pack, cost);
    if (largest == 0 || nothingForThresholds(cost, profile, losses, limits)) return {};
    return byRungs(pack, cost, profile, losses, limits, firstFitting(losses, limits, largest));
}

bool fitsAtHighestThresholds(const PackData& pack, const PackCost& cost, const Profile& profile,
                             const LossTable& losses) {
    const Rungs highest(losses.groupCount(), static_cast<uint8_t>(threshold_rungs.size() - 1));
    return !exceeded(losses, limitsOf(pack, cost, profile, losses), highest);
}

}  // namespace dimmer::cook
