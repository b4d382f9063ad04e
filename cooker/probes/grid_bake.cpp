#include <probes/grid_bake.h>

#include <probes/face_order.h>
#include <probes/placement.h>
#include <probes/tetrahedra.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr uint32_t not_a_member = UINT32_MAX;
// A term that is active where a probe has so large a share belongs to the probe too.
constexpr float share_that_counts = 0.1f;
constexpr std::ptrdiff_t lights_ahead = 8;
constexpr float fit_tolerance = 0.01f;  // errors of interpolation are several times that

// Per position, ascending: the terms of its own place and of the places that it counts at; with the light that was
// traced at its own.
std::vector<std::vector<ProbeTermLight>> tracedAtProbes(const Placement& placed, const Sparse<ProbeTermLight>& light) {
    const size_t probes = placed.place_of.size();
    std::vector<std::vector<uint32_t>> around(probes);
    for (size_t s = 0; s < placed.sites.size(); ++s)
        for (size_t k = 0; k < 4; ++k)
            if (placed.sites[s].shares[k] >= share_that_counts)
                for (const ProbeTermLight& l : light.row(s)) around[placed.sites[s].probes[k]].push_back(l.term);
    std::vector<std::vector<ProbeTermLight>> rows(probes);
    tbb::parallel_for(size_t{0}, probes, [&](size_t i) {
        const auto own = light.row(placed.place_of[i]);
        rows[i].assign(own.begin(), own.end());
        std::ranges::sort(around[i]);
        around[i].erase(std::unique(around[i].begin(), around[i].end()), around[i].end());
        for (const uint32_t term : around[i])
            if (std::ranges::find(own, term, &ProbeTermLight::term) == own.end()) rows[i].push_back({term, {}, 0, 0});
        std::ranges::sort(rows[i], {}, &ProbeTermLight::term);
    });
    return rows;
}

// The light of one term at one place: a site or a probe.
template <class Light>
struct PlaceTerm {
    uint32_t place;
    Light* light;
};
using SiteTerm = PlaceTerm<const ProbeTermLight>;
using ProbeTerm = PlaceTerm<ProbeTermLight>;

// Per term, ascending places. Points into the rows.
template <class Light>
std::vector<std::vector<PlaceTerm<Light>>> byTerm(size_t rows, size_t terms, auto&& rowOf) {
    std::vector<std::vector<PlaceTerm<Light>>> places(terms);
    for (uint32_t i = 0; i < rows; ++i)
        for (auto& l : rowOf(i)) places[l.term].push_back({i, &l});
    return places;
}

// Per probe, ascending: the sites that it counts at.
std::vector<std::vector<uint32_t>> sitesOfProbes(const Placement& placed) {
    std::vector<std::vector<uint32_t>> sites(placed.place_of.size());
    for (uint32_t s = 0; s < placed.sites.size(); ++s)
        for (const uint32_t probe : placed.sites[s].probes)
            if (sites[probe].empty() || sites[probe].back() != s) sites[probe].push_back(s);
    return sites;
}

// One term over the probes that have it and the sites where they count.
class TermFit {
   public:
    // `all_over`: per site, whether it is one of those that are drawn evenly from all air.
    TermFit(const Placement& placed, const std::vector<std::vector<uint32_t>>& sites_of_probes,
            std::span<const uint8_t> all_over, std::span<const SiteTerm> light)
        : placed_(placed),
          sites_of_probes_(sites_of_probes),
          all_over_(all_over),
          light_(light),
          number_(placed.place_of.size(), not_a_member) {}

    void fit(std::span<const ProbeTerm> members) {
        if (members.empty()) return;
        std::vector<FitValue> probes;
        for (const ProbeTerm& member : members) {
            number_[member.place] = static_cast<uint32_t>(probes.size());
            probes.push_back(valueOf(member.light->light));
        }
        chooseSites(members);
        const float floor = floorOfLight();
        for (size_t s = 0; s < sites_.size(); ++s) sites_[s].importance = weigh(targets_[s], variances_[s], floor);
        std::vector<float> own;
        for (size_t i = 0; i < members.size(); ++i) {
            const float importance = weigh(probes[i], members[i].light->variance, floor);
            own.push_back(placed_.guessed[members[i].place] ? 0 : importance);
        }
        fitProbes(sites_, targets_, probes, fit_tolerance, own);
        for (size_t i = 0; i < members.size(); ++i)
            *members[i].light = {members[i].light->term, {std::bit_cast<std::array<glm::vec3, 9>>(probes[i])}, 0, 0};
    }

   private:
    static FitValue valueOf(const ProbeLight& light) { return std::bit_cast<FitValue>(light.radiance); }

    // Ascending. Most terms are of few probes, and most sites none of theirs.
    std::vector<uint32_t> sitesOf(std::span<const ProbeTerm> members) const {
        constexpr uint32_t bits = 64;
        std::vector<uint64_t> marks(placed_.sites.size() / bits + 1);
        for (const ProbeTerm& member : members)
            for (const uint32_t s : sites_of_probes_[member.place]) marks[s / bits] |= uint64_t{1} << s % bits;
        std::vector<uint32_t> sites;
        for (uint32_t w = 0; w < marks.size(); ++w)
            for (uint64_t left = marks[w]; left != 0; left &= left - 1)
                sites.push_back(w * bits + static_cast<uint32_t>(std::countr_zero(left)));
        return sites;
    }

    // Light of one term lies a row's length apart.
    static void prefetch(const ProbeTermLight* light) {
        for (size_t byte = 0; byte < sizeof *light; byte += 64)
            __builtin_prefetch(reinterpret_cast<const char*>(light) + byte);
    }

    // Where the term is not active it is as good as dark.
    void chooseSites(std::span<const ProbeTerm> members) {
        auto lit = light_.begin();
        for (const uint32_t s : sitesOf(members)) {
            for (; lit != light_.end() && lit->place < s; ++lit)
                if (light_.end() - lit > lights_ahead) prefetch(lit[lights_ahead].light);
            FitSite site = placed_.sites[s];
            float known = 0;
            for (size_t k = 0; k < 4; ++k) {
                const uint32_t number = number_[site.probes[k]];
                if (number == not_a_member) site.shares[k] = 0;
                site.probes[k] = number == not_a_member ? 0 : number;
                known += site.shares[k];
            }
            if (!(known > 0)) continue;
            const bool is_lit = lit != light_.end() && lit->place == s;
            targets_.push_back(is_lit ? valueOf(lit->light->light) : FitValue{});
            variances_.push_back(is_lit ? lit->light->variance : 0);
            sites_.push_back(site);
            evenly_drawn_.push_back(all_over_[s]);
        }
    }

    // Of the first coefficient; the mean irradiance is lux_of_brightness times as much.
    static constexpr float lux_of_brightness = 0.886227f;  // sqrt(pi) / 2
    static float brightness(const FitValue& light) { return std::max(0.0f, luminance({light[0], light[1], light[2]})); }

    // Darker places count no more. Half of the places are around lamps, those of one whose direct light is baked up to
    // thousands of times as bright as its room: they count for no more than that again, as in placement. By their mean
    // all of the room was as dark as could be, and probes beside the lamp fitted what lies centimetres off it alone.
    float floorOfLight() const {
        constexpr float floor_of_mean = 0.1f;
        double sum = 0, evenly_drawn_sum = 0;
        size_t evenly_drawn = 0;
        for (size_t s = 0; s < targets_.size(); ++s) {
            const auto light = static_cast<double>(brightness(targets_[s]));
            sum += light;
            if (evenly_drawn_[s]) evenly_drawn_sum += light, ++evenly_drawn;
        }
        double mean = sum / static_cast<double>(std::max<size_t>(1, targets_.size()));
        if (evenly_drawn_sum > 0) mean = std::min(mean, 2 * evenly_drawn_sum / static_cast<double>(evenly_drawn));
        return floor_of_mean * static_cast<float>(mean) + 1e-12f;
    }

    // Between absolute errors and shares, as placement has it, and closer to shares, as lamps' light is known to be
    // fitted to many places here: with 1 instead of 1.5 the 95th percentile near lamps is a tenth larger.
    static float importanceOf(float brightness, float floor) {
        const float share = floor / (brightness + floor);
        return share * std::sqrt(share);  // to the power of 1.5
    }

    // The importance of a place's light. By its own brightness, what noise makes too dark would count more than what it
    // makes too bright, and where few rays find the light most places are too dark: each half of a place's rays counts
    // by what the other half found, and the light becomes their mean (of halves that are alike in all but how much
    // they found).
    static float weigh(FitValue& light, float variance_lux2, float floor) {
        const float whole = brightness(light);
        if (!(whole > 0)) return importanceOf(0, floor);
        const float off = std::min(std::sqrt(variance_lux2) / lux_of_brightness, whole);
        const float first = whole + off, second = whole - off;
        const float of_first = importanceOf(second, floor), of_second = importanceOf(first, floor);
        const float both = of_first + of_second, scale = (of_first * first + of_second * second) / (both * whole);
        for (float& v : light) v *= scale;
        return both / 2;
    }

    const Placement& placed_;
    const std::vector<std::vector<uint32_t>>& sites_of_probes_;
    std::span<const uint8_t> all_over_;
    std::span<const SiteTerm> light_;
    std::vector<uint32_t> number_;  // per position, among the probes of the term
    std::vector<FitSite> sites_;
    std::vector<uint8_t> evenly_drawn_;  // per one of these
    std::vector<FitValue> targets_;
    std::vector<float> variances_;  // of the targets' irradiance, lux^2
};

}  // namespace

Expected<BakedGrid> bakeGrid(const RayScene& rays, const SiteChoice& choice, const Sparse<ProbeTermLight>& light,
                             std::span<const Term> terms, const GridSettings& settings, Progress& progress) {
    BakedGrid out;
    out.free_volume_m3 = choice.free_volume_m3;
    const std::vector<SiteRow> order = siteOrder(choice.blocks);
    const std::vector<FitValue> states = statesOf(rays.scene(), light, terms, order);
    auto placed = placeProbes(rays, choice, states, settings, progress);
    if (!placed) return std::unexpected(placed.error());
    progress.stage("probes", terms.size());
    // Blocks of rows are large for so few receivers, so each row is made on its own.
    auto rows = tracedAtProbes(*placed, light);
    if (settings.fit) {
        const auto sites =
            byTerm<const ProbeTermLight>(light.rows(), terms.size(), [&](uint32_t s) { return light.row(s); });
        const auto members =
            byTerm<ProbeTermLight>(rows.size(), terms.size(), [&](uint32_t i) { return std::span(rows[i]); });
        const auto sites_of_probes = sitesOfProbes(*placed);
        std::vector<uint8_t> all_over;
        for (const SiteRow& site : order) all_over.push_back(site.block == 0);
        tbb::parallel_for(size_t{0}, terms.size(), [&](size_t t) {
            TermFit(*placed, sites_of_probes, all_over, sites[t]).fit(members[t]);
            progress.advance(1);
        });
    }
    out.grid = std::move(placed->grid);
    out.errors = std::move(placed->errors);
    const std::vector<uint32_t> placed_as = orderByFaces(out.grid);
    out.light = Sparse<ProbeTermLight>::build(placed_as.size(), [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) emit(std::span<const ProbeTermLight>(rows[placed_as[i]]));
    });
    return out;
}

}  // namespace dimmer::cook
