#include <pipeline/fit.h>
#include <pipeline/fit_ways.h>

namespace dimmer::cook {
namespace {

// Records of texels were up to 4 % more than charts' areas say on large levels, up to 18 % on one of two rooms: they
// are to take this share of their room. Pages are packed as a cook packs them, and need none to spare; as their sizes
// go in steps, there may be none.
constexpr double records_margin = 0.92;
constexpr int density_steps_max = 14;  // of halving: to a thousandth

// A budget that density helps with: what of it are pages, what goes with charts' texels, and what stays.
struct Share {
    uint64_t budget, pages, texels, stays;

    bool over() const { return budget > 0 && pages + texels + stays > budget; }
    // Whether it fits with records at `margin` of their room; with `power` above 1, with more to spare.
    bool fitsWith(const LossTable::TexelsLeft& left, double margin, double power) const {
        if (budget <= stays) return false;
        const uint64_t room = budget - stays;
        const uint64_t wanted = scaledBytes(room, std::pow(ratio(room, pages + texels), power - 1));
        return scaledBytes(pages, left.pages) + scaledBytes(texels, left.charts / margin) <= wanted;
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

}  // namespace

bool pagesOrRecordsAreOver(const PackCost& cost, const Profile& profile) {
    return !sharesOver(cost, profile).empty();
}

Remedy byDensity(const PackCost& cost, const Profile& profile, const LossTable& losses, size_t steps_before) {
    Remedy remedy;
    const std::vector<Share> over = sharesOver(cost, profile);
    if (over.empty()) return remedy;
    // Where two steps fell short already, go further than it takes.
    const double power = 1 + 0.5 * static_cast<double>(std::max<size_t>(steps_before, 1) - 1);
    double margin = records_margin;
    const auto enough = [&](double factor) {
        const LossTable::TexelsLeft left = losses.texelsLeft(factor);
        return std::ranges::all_of(over, [&](const Share& s) { return s.fitsWith(left, margin, power); });
    };
    double too_little = 1, factor = density_factor_max;
    if (const auto least = losses.texelsLeft(factor); least.pages >= 1 && least.charts >= 1) return remedy;
    if (!enough(factor)) margin = 1;
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
    remedy.saves = scaledBytes(cost.base_lightmap, std::max(0.0, 1 - left.pages)) +
                   scaledBytes(cost.dynamic - cost.probe_records + cost.ancillary, 1 - left.charts);
    return remedy;
}

}  // namespace dimmer::cook
