#include <probes/trial_grid.h>

#include <bake/sampling.h>
#include <probes/grid_error.h>
#include <probes/spherical_harmonics.h>
#include <probes/tetrahedra.h>
#include <probes/visibility.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace dimmer::cook {
namespace {

// What is hopelessly wrong is not worse than that. Where probes are few, a leak into the dark may be all that one
// spoils; where they are many, slices as thin as a hand would draw too many of them.
constexpr float error_max_of_few = 8, error_max_of_many = 2;
constexpr size_t few_probes = 4000;
constexpr float importance_floor = 0.05f;  // of the mean light: darker places count no more
// Of the mean light: errors of what is darker are as small as it. Every group counts alike here, so that faint ones ask
// for probes as bright ones do: at 0.01, the floor of error measures, lq_old_start gets 18,000.
constexpr float floor_of_mean = 0.03f;
constexpr float search_tolerance = 0.01f;  // of fits on the way: errors that count are larger
// Of tables on the way: where there are few probes each of them counts, and all of a tetrahedron.
constexpr size_t search_points_min = 12, search_points_times_probes = 12000;

}  // namespace

TrialGrid::TrialGrid(const RayScene& rays, const SiteChoice& choice, std::span<const FitValue> states,
                     const GridSettings& settings)
    : rays_(rays),
      cells_(rays),
      air_(choice.air),
      states_(states),
      settings_(settings),
      places_(choice.places()),
      error_max_(choice.probes_max <= few_probes ? error_max_of_few : error_max_of_many),
      first_corner_(places_.size() - choice.blocks.back().places_m.size()),
      search_points_(static_cast<uint32_t>(
          std::clamp<size_t>(search_points_times_probes / choice.probes_max, search_points_min, visibility_points))) {
    auto corner = static_cast<uint32_t>(first_corner_);
    for (const bool is_free : choice.corner_free) corners_.push_back(is_free ? corner++ : no_index);
    decideImportance(siteOrder(choice.blocks));
}

// How wrong a probe's place would be without it, by what its neighbours in sight have, times what it stands for.
std::vector<float> TrialGrid::usefulness() const {
    const size_t count = probes_.places.size();
    std::vector<FitValue> around(count, FitValue{});
    std::vector<float> weight(count, 0), useful(count, 0), shares(count, 0);
    for (const auto& [a, b] : edges()) {
        const glm::vec3 p = places_[probes_.places[a]], q = places_[probes_.places[b]];
        if (rays_.blocked(p, q)) continue;
        const float near = 1 / glm::dot(p - q, p - q);
        for (const auto& [to, from] : {std::pair(a, b), std::pair(b, a)}) {
            weight[to] += near;
            for (size_t c = 0; c < 27; ++c) around[to][c] += near * states_[probes_.places[from]][c];
        }
    }
    for (const FitSite& s : result_.placement.sites)
        for (size_t k = 0; k < 4; ++k)
            if (s.probes[k] < count) shares[s.probes[k]] += s.shares[k];
    for (size_t i = 0; i < count; ++i) {
        for (float& v : around[i]) v /= std::max(weight[i], 1e-12f);
        useful[i] = shares[i] * errorOf(around[i], states_[probes_.places[i]]);
    }
    return useful;
}

// Of the tetrahedra, between probes; each once, ascending.
std::vector<std::pair<uint32_t, uint32_t>> TrialGrid::edges() const {
    std::vector<std::pair<uint32_t, uint32_t>> list;
    for (const Tetrahedron& t : result_.placement.grid.tetrahedra)
        for (const uint32_t a : t.probes)
            for (const uint32_t b : t.probes)
                if (a < b && b < probes_.places.size()) list.emplace_back(a, b);
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
    return list;
}

// Between absolute errors and shares of the light that is there: least squares of shares would have lamps' light
// too dark, as too bright costs more.
void TrialGrid::decideImportance(std::span<const SiteRow> order) {
    // From the first coefficient to the mean irradiance: sqrt(pi) / 2.
    const float to_lux = std::sqrt(pi) / 2;
    const auto meanOf = [&](auto&& counts) {
        double sum = 0;
        size_t places = 0;
        for (size_t i = 0; i < first_corner_; ++i)
            if (counts(order[i])) sum += static_cast<double>(to_lux * states_[i][0]), ++places;
        return places == 0 ? 0.0f : static_cast<float>(sum / static_cast<double>(places));
    };
    // Half of the places are around lamps, and those of a lamp whose direct light is baked up to thousands of times as
    // bright as the level: they count for no more than that again.
    const float all_over = meanOf([](const SiteRow& r) { return r.block == 0; });
    float mean = meanOf([](const SiteRow&) { return true; });
    if (all_over > 0) mean = std::min(mean, 2 * all_over);
    floor_lux_ = std::max(mean * floor_of_mean, 1e-12f);
    for (const FitValue& state : states_) {
        const float lux = to_lux * state[0] + importance_floor * mean + 1e-12f;
        importance_.push_back(1 / lux);
    }
}

Expected<void> TrialGrid::build(const ChosenProbes& probes, size_t places) {
    probes_ = probes;
    is_probe_.assign(first_corner_, false);
    std::vector<glm::vec3> points;
    for (const uint32_t i : probes_.places) {
        points.push_back(places_[i]);
        is_probe_[i] = true;
    }
    auto grid = tetrahedralise(points, air_);
    if (!grid) return std::unexpected(grid.error());
    result_.placement.grid = std::move(*grid);
    std::ranges::copy(probes_.levels, result_.placement.grid.levels.begin());
    findPlaces();
    locatePlaces(places);
    if (settings_.visibility) findVisibility(Asked::AtPlaces, search_points_);
    findShares();
    findErrors();
    return {};
}

void TrialGrid::restore(ChosenProbes probes, Result result) {
    probes_ = std::move(probes);
    result_ = std::move(result);
    is_probe_.assign(first_corner_, false);
    for (const uint32_t i : probes_.places) is_probe_[i] = true;
}

Placement TrialGrid::take() {
    if (settings_.visibility) {
        seen_.clear();
        findVisibility(Asked::Anywhere, visibility_points);
        findShares();
    }
    return std::move(result_.placement);
}

double TrialGrid::meanError() const {
    double sum = 0;
    for (const float e : result_.errors) sum += static_cast<double>(e);
    return sum / static_cast<double>(result_.errors.size());
}

// The place that a position is; no_index: a corner that is not free.
uint32_t TrialGrid::placeOf(uint32_t position) const {
    return position < probes_.places.size() ? probes_.places[position] : corners_[position - probes_.places.size()];
}
bool TrialGrid::isFree(uint32_t position) const {
    return placeOf(position) != no_index;
}

void TrialGrid::findPlaces() {
    const auto count = static_cast<uint32_t>(result_.placement.grid.positions.size());
    result_.placement.place_of.resize(count);
    result_.placement.guessed.assign(count, 0);
    for (uint32_t i = 0; i < count; ++i) {
        result_.placement.place_of[i] = placeOf(i);
        result_.placement.guessed[i] = !isFree(i);
        float nearest = std::numeric_limits<float>::infinity();
        for (uint32_t k = 0; k < count && !isFree(i); ++k) {
            if (!isFree(k)) continue;
            const float distance = glm::distance(vec(result_.placement.grid.positions[i]), places_[placeOf(k)]);
            if (distance < nearest) nearest = distance, result_.placement.place_of[i] = placeOf(k);
        }
    }
}

// Not the box's corners, which were traced for themselves: outside of the level they would tell probes of darkness.
void TrialGrid::locatePlaces(size_t places) {
    result_.at.resize(places);
    tbb::parallel_for(size_t{0}, places, [&](size_t i) {
        const glm::vec3 p = places_[i];
        result_.at[i] = locate(result_.placement.grid, {p.x, p.y, p.z});
    });
}

void TrialGrid::findShares() {
    result_.placement.sites.resize(result_.at.size());
    tbb::parallel_for(size_t{0}, result_.at.size(), [&](size_t i) {
        result_.placement.sites[i] = {.probes = result_.placement.grid.tetrahedra[result_.at[i].tetrahedron].probes,
                                      .shares = probeWeights(result_.placement.grid, result_.at[i]),
                                      .importance = importance_[i]};
    });
}

size_t TrialGrid::HashOfKey::operator()(const Key& key) const {
    uint32_t sum = 0;
    for (const uint32_t k : key) sum = hash(sum, k);
    return sum;
}

// Tetrahedra of earlier rounds keep what was found (from the places looked at then): by the sites that their probes
// are, and the corners.
TrialGrid::Key TrialGrid::keyOf(const Tetrahedron& t) const {
    const auto name = [&](uint32_t position) {
        return position < probes_.places.size()
                   ? probes_.places[position]
                   : static_cast<uint32_t>(places_.size() + position - probes_.places.size());
    };
    return {name(t.probes[0]), name(t.probes[1]), name(t.probes[2]), name(t.probes[3])};
}

void TrialGrid::findVisibility(Asked asked, uint32_t points) {
    GlobalGrid& grid = result_.placement.grid;
    grid.visibility.assign(grid.tetrahedra.size(), {});
    std::vector<uint8_t> wanted(grid.tetrahedra.size(), asked == Asked::Anywhere);
    for (size_t i = 0; i < result_.at.size(); ++i)
        if (!is_probe_[i]) wanted[result_.at[i].tetrahedron] = 1;
    std::vector<uint32_t> fresh, number(grid.tetrahedra.size(), no_index);
    for (uint32_t t = 0; t < grid.tetrahedra.size(); ++t) {
        if (!wanted[t]) continue;
        const auto found = seen_.find(keyOf(grid.tetrahedra[t]));
        if (found != seen_.end()) {
            grid.visibility[t] = found->second;
        } else {
            number[t] = static_cast<uint32_t>(fresh.size());
            fresh.push_back(t);
        }
    }
    std::vector<std::vector<std::array<float, 4>>> inside(fresh.size());
    for (size_t i = 0; i < result_.at.size(); ++i)
        if (const uint32_t n = number[result_.at[i].tetrahedron]; n != no_index && !is_probe_[i])
            inside[n].push_back(result_.at[i].barycentric);
    tbb::parallel_for(size_t{0}, fresh.size(), [&](size_t i) {
        const Tetrahedron& t = grid.tetrahedra[fresh[i]];
        std::array<glm::vec3, 4> corners;
        std::array<bool, 4> free;
        for (size_t k = 0; k < 4; ++k) {
            corners[k] = vec(grid.positions[t.probes[k]]);
            free[k] = isFree(t.probes[k]);
        }
        grid.visibility[fresh[i]] = cook::findVisibility(rays_, air_, corners, free, inside[i], &cells_, points);
    });
    for (const uint32_t t : fresh) seen_.emplace(keyOf(grid.tetrahedra[t]), grid.visibility[t]);
}

float TrialGrid::errorOf(const FitValue& light, const FitValue& traced) const {
    float sum = 0;
    for (size_t state = 0; state < site_states; ++state)
        sum += gridError(&light[9 * state], &traced[9 * state], floor_lux_, error_max_);
    return sum / site_states;
}

// With the light that probes would be given.
void TrialGrid::findErrors() {
    std::vector<FitValue> probes;
    std::vector<float> own;
    for (size_t i = 0; i < result_.placement.place_of.size(); ++i) {
        const uint32_t place = result_.placement.place_of[i];
        probes.push_back(states_[place]);
        own.push_back(result_.placement.guessed[i] ? 0 : importance_[place]);
    }
    const std::vector<FitSite>& sites = result_.placement.sites;
    fitProbes(sites, states_.first(sites.size()), probes, search_tolerance, own);
    result_.errors.resize(sites.size());
    tbb::parallel_for(size_t{0}, sites.size(), [&](size_t i) {
        const FitSite& site = sites[i];
        FitValue light{};
        for (size_t k = 0; k < 4; ++k)
            for (size_t c = 0; c < light.size(); ++c) light[c] += site.shares[k] * probes[site.probes[k]][c];
        result_.errors[i] = is_probe_[i] ? 0 : errorOf(light, states_[i]);
    });
}

}  // namespace dimmer::cook
