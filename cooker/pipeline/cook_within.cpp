#include <pipeline/cook_within.h>

#include <pipeline/settings.h>

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace dimmer::cook {
namespace {

// The cheapest ways out of a budget that a message names.
constexpr size_t remedies_named = 3;

// Each round of `--fit` cooks anew: more than a few mean that something does not follow its prediction.
constexpr int fit_rounds_max = 6;

// Those that are enough come first, so that a first one that is not tells of all: then one of each kind is named.
std::string waysOut(const std::vector<Remedy>& found) {
    if (found.empty()) return "; none of the settings that were tried mends it";
    const bool fits = found[0].fits;
    std::string text = fits ? "; what would help:" : "; nothing is enough by itself; what would help:";
    const std::vector<Remedy> named = fits ? found : bestOfEachKind(found);
    for (const Remedy& remedy : std::span(named).first(fits ? std::min(named.size(), remedies_named) : named.size()))
        text += "\n  " + remedy.text(fits && !remedy.fits ? " (not enough by itself)" : "");
    return text;
}

// What remains where nothing is enough by itself.
std::string lastWays(const PackCost& cost, const Profile& profile, bool fit_would_do) {
    std::string text;
    if (isOver(cost.global_grid, profile.budget_global_grid))
        text += "\n  --set grids.global=off leaves out the global grid, and with it the light of what moves";
    if (fit_would_do) text += "\n--fit tries these together";
    return text;
}

// As predicted: of surfaces, or of what moves, where that is more.
double errorOf(const std::vector<Remedy>& fitted, const Remedy& next) {
    double surfaces = next.error, models = next.grid_error.value_or(0);
    for (const Remedy& remedy : fitted) {
        surfaces += remedy.error;
        models += remedy.grid_error.value_or(0);
    }
    return std::max(surfaces, models);
}

std::string tooLossy(double error, float error_max) {
    return fmt::format(
        "; --fit would add a mean error of {:.2f} %, more than the {:.2f} % of --fit-max-error: allow more "
        "there, or raise the budget",
        100 * error, 100 * error_max);
}

// The figures of an error are those of the last cook, not of the settings that were asked for.
std::string changedBefore(const std::vector<Remedy>& fitted) {
    std::string text = fitted.empty() ? "" : "\n--fit had changed before this cook:";
    for (const Remedy& remedy : fitted) text += "\n  " + remedy.text();
    return text;
}

}  // namespace

Expected<void> applyRemedy(const Remedy& remedy, Profile& profile) {
    for (const Change& c : remedy.changes)
        if (auto ok = assignText(profile, fmt::format("{}={}", c.key, c.to), "--fit", "fit"); !ok) return ok;
    return {};
}

Expected<PackData> cookWithin(const Scene& scene, const CookOptions& options, Progress& progress, CookCache* cache,
                              CookResult& result) {
    const std::vector<std::string> import_warnings = result.stats.warnings;
    for (int round = 0;; ++round) {
        result.stats.warnings = import_warnings;
        result.stats.suggested_combinations.clear();
        LossTable losses;
        if (cache) cache->beginRound(round);
        auto pack = cookScene(scene, result.profile, options.quality, progress, result.stats, cache, &losses);
        if (!pack) return pack;
        const PackCost cost = costOf(*pack);
        const auto within = checkBudgets(*pack, cost, result.profile);
        if (within) {
            for (const Remedy& remedy : result.fitted)
                result.stats.warnings.push_back("over budget, --fit changed settings: " + remedy.text());
            return pack;
        }
        const auto overBudget = [&](const std::string& why) {
            result.remedies = remedies(*pack, cost, result.profile, losses);
            std::string ways = waysOut(result.remedies);
            if (result.remedies.empty() || !result.remedies[0].fits)
                ways += lastWays(cost, result.profile,
                                 !options.fit && !fittingRemedy(*pack, cost, result.profile, losses).changes.empty());
            result.pack = std::move(*pack);
            return fail(ErrorCode::OverBudget, within.error().message + why + ways + changedBefore(result.fitted));
        };
        if (!options.fit || round + 1 == fit_rounds_max) return overBudget("");
        const auto density_steps =
            std::ranges::count_if(result.fitted, [](const Remedy& r) { return r.changes.front().key == density_key; });
        Remedy remedy = fittingRemedy(*pack, cost, result.profile, losses, static_cast<size_t>(density_steps));
        if (remedy.changes.empty()) return overBudget("; all that --fit changes would not be enough");
        if (const double error = errorOf(result.fitted, remedy);
            options.fit_error_max && error > static_cast<double>(*options.fit_error_max))
            return overBudget(tooLossy(error, *options.fit_error_max));
        if (auto ok = applyRemedy(remedy, result.profile); !ok) return std::unexpected(ok.error());
        result.fitted.push_back(std::move(remedy));
    }
}

}  // namespace dimmer::cook
