#include <pipeline/fit.h>

#include <pipeline/settings.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace dimmer::cook {
namespace {

// The next density leaves this much room: charts do not shrink in proportion, as their padding stays.
constexpr double density_margin = 0.97;

// One budget that is set: what it would hold at some rungs.
struct Limit {
    uint64_t budget;
    std::function<uint64_t(const Rungs&)> bytes;
    std::function<uint64_t(uint32_t, uint8_t, uint8_t)> saved_by;  // group, from, to
};

std::vector<Limit> limitsOf(const PackData& pack, const PackCost& cost, const Profile& profile,
                            const LossTable& losses) {
    std::vector<Limit> limits;
    const auto records = [&losses](uint32_t g, uint8_t from, uint8_t to) { return losses.step(g, from, to).bytes; };
    const auto dynamic = [&losses](const Rungs& rungs) { return losses.dynamicBytes(rungs); };
    if (profile.budget_dynamic > 0) limits.push_back({profile.budget_dynamic, dynamic, records});
    const uint64_t rest = cost.device() - cost.dynamic;
    if (profile.budget_total > 0)
        limits.push_back({profile.budget_total, [=](const Rungs& rungs) { return rest + dynamic(rungs); }, records});
    const auto first_door =
        static_cast<uint32_t>(std::ranges::count(pack.elements, ElementKind::LightSet, &Element::kind));
    for (const ElementCost& e : cost.elements) {
        if (profile.budget_per_element == 0) break;
        const auto of_element = [&losses, e, first_door](uint32_t g, uint8_t from, uint8_t to) {
            if (e.element >= first_door) return losses.doorBytes(g, from, to, e.element - first_door);
            return g == 1 + e.element ? losses.step(g, from, to).bytes : uint64_t{0};
        };
        limits.push_back({profile.budget_per_element,
                          [of_element, e](const Rungs& rungs) {
                              uint64_t bytes = e.bytes;
                              for (uint32_t g = 0; g < rungs.size(); ++g) bytes -= of_element(g, 0, rungs[g]);
                              return bytes;
                          },
                          of_element});
    }
    return limits;
}

const Limit* exceeded(const std::vector<Limit>& limits, const Rungs& rungs) {
    const auto it = std::ranges::find_if(limits, [&](const Limit& l) { return l.bytes(rungs) > l.budget; });
    return it == limits.end() ? nullptr : &*it;
}

float thresholdOf(const PackData& pack, const Profile& profile, uint32_t group) {
    const auto own = profile.set_thresholds.find(pack.elements[group - 1].name);
    return own == profile.set_thresholds.end() ? profile.threshold : own->second;
}

Remedy byRungs(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
               const std::vector<Limit>& limits, const Rungs& rungs) {
    Remedy remedy;
    const Loss loss = losses.loss(rungs);
    remedy.saves = cost.dynamic - std::min(cost.dynamic, losses.dynamicBytes(rungs));
    remedy.error = loss.error;
    remedy.energy = loss.energy;
    remedy.fits = exceeded(limits, rungs) == nullptr;
    for (uint32_t g = 1; g < rungs.size(); ++g) {
        if (rungs[g] == 0) continue;
        const float from = thresholdOf(pack, profile, g);
        remedy.changes.push_back({std::string(set_threshold_prefix) + pack.elements[g - 1].name, from,
                                  std::min(1.0f, threshold_rungs[rungs[g]] * from)});
    }
    return remedy;
}

// Always the step that loses the least light for the bytes that the exceeded budget is over by.
Rungs greedy(const LossTable& losses, const std::vector<Limit>& limits) {
    Rungs rungs(losses.groupCount(), 0);
    while (const Limit* limit = exceeded(limits, rungs)) {
        uint32_t best_group = 0;
        uint8_t best_rung = 0;
        double best = INFINITY;
        for (uint32_t g = 1; g < rungs.size(); ++g)
            for (auto r = static_cast<uint8_t>(rungs[g] + 1); r < threshold_rungs.size(); ++r) {
                const uint64_t saved = limit->saved_by(g, rungs[g], r);
                const double price =
                    losses.step(g, rungs[g], r).error / static_cast<double>(std::max<uint64_t>(saved, 1));
                if (saved == 0 || !(price < best)) continue;
                best = price;
                best_group = g;
                best_rung = r;
            }
        if (best_rung == 0) break;
        rungs[best_group] = best_rung;
    }
    return rungs;
}

// The first rung at which everything fits, for one group or for all of them.
Rungs firstFitting(const LossTable& losses, const std::vector<Limit>& limits, uint32_t group) {
    Rungs rungs(losses.groupCount(), 0);
    for (uint8_t r = 1; r < threshold_rungs.size(); ++r) {
        for (uint32_t g = 1; g < rungs.size(); ++g)
            if (group == no_index || g == group) rungs[g] = r;
        if (!exceeded(limits, rungs)) break;
    }
    return rungs;
}

Remedy byDensity(const PackCost& cost, const Profile& profile, const LossTable& losses) {
    double over = 1;
    const auto compare = [&](uint64_t bytes, uint64_t budget) {
        if (budget > 0) over = std::max(over, static_cast<double>(bytes) / static_cast<double>(budget));
    };
    compare(cost.device(), profile.budget_total);
    compare(cost.base_lightmap, profile.budget_base_lightmaps);
    compare(cost.dynamic, profile.budget_dynamic);
    for (const ElementCost& e : cost.elements) compare(e.bytes, profile.budget_per_element);
    const double factor = std::sqrt(over) / density_margin;
    Remedy remedy{.changes = {}, .fits = true, .saves = 0, .error = losses.densityError(factor), .energy = 0};
    const float to = std::max(0.01f, std::floor(profile.texels_per_metre / static_cast<float>(factor) * 100) / 100);
    remedy.changes.push_back({"lightmaps.texels_per_metre", profile.texels_per_metre, to});
    remedy.saves = static_cast<uint64_t>(static_cast<double>(cost.device()) * (1 - 1 / (factor * factor)));
    return remedy;
}

uint32_t largestSet(const PackData& pack, const PackCost& cost) {
    const auto sets =
        std::span(cost.elements)
            .first(static_cast<size_t>(std::ranges::count(pack.elements, ElementKind::LightSet, &Element::kind)));
    return sets.empty() ? 0 : 1 + std::ranges::max_element(sets, {}, &ElementCost::bytes)->element;
}

bool baseIsOver(const PackCost& cost, const Profile& profile) {
    return profile.budget_base_lightmaps > 0 && cost.base_lightmap > profile.budget_base_lightmaps;
}

}  // namespace

std::string Remedy::text() const {
    constexpr size_t named_max = 4;
    std::vector<std::string> parts;
    for (const Change& c : changes)
        if (parts.size() < named_max) parts.push_back(fmt::format("{} {} -> {}", c.key, c.from, c.to));
    const std::string more =
        changes.size() > named_max ? fmt::format(" and {} more", changes.size() - named_max) : std::string();
    return fmt::format("{}{}: saves {:.2f} MB, adds a mean error of {:.2f} %{}", fmt::join(parts, ", "), more,
                       static_cast<double>(saves) / 1e6, 100 * error,
                       energy > 0 ? fmt::format(", drops up to {:.2f} % of a set's light", 100 * energy) : "");
}

std::vector<Remedy> remedies(const PackData& pack, const PackCost& cost, const Profile& profile,
                             const LossTable& losses) {
    const auto limits = limitsOf(pack, cost, profile, losses);
    std::vector<Remedy> found = {byDensity(cost, profile, losses)};
    if (!baseIsOver(cost, profile)) {
        const auto add = [&](const Rungs& rungs) {
            Remedy remedy = byRungs(pack, cost, profile, losses, limits, rungs);
            if (remedy.saves > 0) found.push_back(std::move(remedy));
        };
        add(greedy(losses, limits));
        add(firstFitting(losses, limits, no_index));
        if (const uint32_t largest = largestSet(pack, cost); largest > 0) add(firstFitting(losses, limits, largest));
    }
    std::ranges::stable_sort(found, [](const Remedy& a, const Remedy& b) {
        return std::pair(!a.fits, a.error) < std::pair(!b.fits, b.error);
    });
    return found;
}

Remedy fittingRemedy(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses) {
    const auto limits = limitsOf(pack, cost, profile, losses);
    if (!baseIsOver(cost, profile)) {
        Remedy thresholds = byRungs(pack, cost, profile, losses, limits, greedy(losses, limits));
        if (thresholds.fits && !thresholds.changes.empty()) return thresholds;
    }
    return byDensity(cost, profile, losses);
}

}  // namespace dimmer::cook
