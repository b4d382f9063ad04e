#include <probes/placement.h>

#include <bake/sampling.h>
#include <probes/free_space.h>
#include <probes/grid_error.h>
#include <probes/neighbourhood.h>
#include <probes/tetrahedra.h>
#include <probes/tetrahedron_walk.h>
#include <probes/visibility.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace dimmer::cook {
namespace {

// On average over the free space: the grid need not be denser to be as right as lightmaps are.
constexpr double density_max_per_m3 = 1;
// Small levels can have more, and need it, as single probes matter.
constexpr double small_sites_per_probe = 40, small_sites = 4000;
constexpr uint32_t sites_max = 60000;
constexpr uint32_t first_look = 2000;  // sites that tell how much of the level is free
constexpr float coarse_spacing_m = 4;  // of the first probes
constexpr float sparse_spacing = 2;    // outside of play areas
constexpr double growth = 0.1;         // of the number of probes in a round, at most
constexpr uint32_t grow_rounds_max = 64;
// The more sites there are to a probe, the more rounds of exchange find better ones among them.
constexpr size_t sites_per_exchange = 2, exchange_rounds_max = 16;
constexpr size_t exchange_part = 5;        // one in so many is exchanged
constexpr float importance_floor = 0.05f;  // of the mean light: darker sites count no more
constexpr float floor_of_mean = 0.01f;     // as the error measures have it

class Placer {
   public:
    Placer(const Sites& sites, const GridSettings& settings, Progress& progress)
        : sites_(sites),
          settings_(settings),
          progress_(progress),
          rays_(sites.gatherer().rays()),
          near_(coarse_spacing_m) {}

    Expected<Placement> run() {
        if (auto ok = chooseSites(); !ok) return std::unexpected(ok.error());
        if (places_.empty()) return std::move(out_);
        out_.light = sites_.trace(places_, progress_);
        decideImportance();
        settings_.uniform ? placeLattice() : placeCoarse();
        if (auto ok = build(); !ok) return std::unexpected(ok.error());
        if (!settings_.uniform) {
            progress_.stage("probe placement", exchangeRounds() + 1);
            if (auto ok = grow(); !ok) return std::unexpected(ok.error());
            if (auto ok = exchange(); !ok) return std::unexpected(ok.error());
        }
        // Corners of the box were traced for themselves: outside of the level they would tell probes of darkness.
        out_.sites.resize(first_corner_);
        out_.light.resize(first_corner_);
        return std::move(out_);
    }

   private:
    // Adds probes until they are as many as may be, or nothing is wrong.
    Expected<void> grow() {
        for (uint32_t round = 0; round < grow_rounds_max && probes_.size() < limit_; ++round) {
            findErrors();
            if (!refine()) break;
            if (auto ok = build(); !ok) return ok;
        }
        findErrors();
        progress_.advance(1);
        return {};
    }

    // Again and again, a fifth of the probes that do least go, and others come where they are needed more; the best
    // set that was seen stays.
    Expected<void> exchange() {
        auto best = std::pair(probes_, levels_);
        double least = meanError();
        for (size_t round = 0; round < exchangeRounds(); ++round) {
            thinOut();
            if (auto ok = build(); !ok) return ok;
            if (auto ok = grow(); !ok) return ok;
            if (!(meanError() < least)) continue;
            least = meanError();
            best = {probes_, levels_};
        }
        std::tie(probes_, levels_) = best;
        return build();
    }

    size_t exchangeRounds() const { return std::min(exchange_rounds_max, first_corner_ / limit_ / sites_per_exchange); }

    double meanError() const {
        double sum = 0;
        for (const float e : error_) sum += static_cast<double>(e);
        return sum / static_cast<double>(error_.size());
    }

    // How wrong a probe's place would be without it, by what its neighbours in sight have, times what it stands for.
    std::vector<float> usefulness() const {
        const size_t count = probes_.size();
        std::vector<FitValue> around(count, FitValue{});
        std::vector<float> weight(count, 0), useful(count, 0), shares(count, 0);
        for (const auto& [a, b] : edges()) {
            const glm::vec3 p = places_[probes_[a]], q = places_[probes_[b]];
            if (rays_.blocked(p, q)) continue;
            const float near = 1 / glm::dot(p - q, p - q);
            for (const auto& [to, from] : {std::pair(a, b), std::pair(b, a)}) {
                weight[to] += near;
                for (size_t c = 0; c < 27; ++c) around[to][c] += near * out_.light[probes_[from]].states[c];
            }
        }
        for (const FitSite& s : out_.sites)
            for (size_t k = 0; k < 4; ++k)
                if (s.probes[k] < count) shares[s.probes[k]] += s.shares[k];
        for (size_t i = 0; i < count; ++i) {
            for (float& v : around[i]) v /= std::max(weight[i], 1e-12f);
            useful[i] = shares[i] * errorOf(around[i], out_.light[probes_[i]].states);
        }
        return useful;
    }

    // Of the tetrahedra, between probes; each once, ascending.
    std::vector<std::pair<uint32_t, uint32_t>> edges() const {
        std::vector<std::pair<uint32_t, uint32_t>> list;
        for (const Tetrahedron& t : out_.grid.tetrahedra)
            for (const uint32_t a : t.probes)
                for (const uint32_t b : t.probes)
                    if (a < b && b < probes_.size()) list.emplace_back(a, b);
        std::ranges::sort(list);
        list.erase(std::unique(list.begin(), list.end()), list.end());
        return list;
    }

    void thinOut() {
        const std::vector<float> useful = usefulness();
        std::vector<uint32_t> order(probes_.size());
        std::iota(order.begin(), order.end(), 0u);
        std::ranges::stable_sort(order, {}, [&](uint32_t i) { return useful[i]; });
        order.erase(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(order.size() / exchange_part));
        std::ranges::sort(order);
        const auto probes = std::exchange(probes_, {});
        const auto levels = std::exchange(levels_, {});
        near_ = Neighbourhood(coarse_spacing_m);
        is_probe_.assign(first_corner_, false);
        for (const uint32_t i : order) {
            near_.add(places_[probes[i]]);
            is_probe_[probes[i]] = true;
            probes_.push_back(probes[i]);
            levels_.push_back(levels[i]);
        }
    }

    // Free places, and behind them the corners of the box.
    Expected<void> chooseSites() {
        double share = 0;
        sites_.choose(first_look, share);
        const glm::dvec3 size = glm::dvec3(rays_.boundsMax()) - glm::dvec3(rays_.boundsMin());
        out_.free_volume_m3 = share * size.x * size.y * size.z;
        const auto most = static_cast<double>(settings_.probes_max);
        // The box's corners are probes too.
        limit_ = static_cast<size_t>(std::clamp(density_max_per_m3 * out_.free_volume_m3 - 8, 8.0, most));
        const auto probes = static_cast<double>(limit_);
        const double wanted = std::max(settings_.sites * probes, std::min(small_sites_per_probe * probes, small_sites));
        const auto count = static_cast<uint32_t>(std::min(wanted, static_cast<double>(sites_max)));
        places_ = sites_.choose(count, share);
        if (places_.empty()) return {};
        first_corner_ = places_.size();
        const auto box = tetrahedralise({}, {rays_.boundsMin(), rays_.boundsMax()});
        if (!box) return std::unexpected(box.error());
        for (const ProbePosition& corner : box->positions) {
            places_.push_back(vec(corner));
            corner_free_.push_back(inTheOpen(rays_, places_.back()));
        }
        is_probe_.assign(first_corner_, false);
        return {};
    }

    // Between absolute errors and shares of the light that is there: least squares of shares would have lamps' light
    // too dark, as too bright costs more.
    void decideImportance() {
        // From the first coefficient to the mean irradiance: sqrt(pi) / 2.
        const float to_lux = std::sqrt(pi) / 2;
        double sum = 0;
        for (size_t i = 0; i < first_corner_; ++i) sum += static_cast<double>(to_lux * out_.light[i].states[0]);
        const auto mean = static_cast<float>(sum / static_cast<double>(first_corner_));
        floor_lux_ = std::max(mean * floor_of_mean, 1e-12f);
        for (const SiteLight& l : out_.light) {
            const float lux = to_lux * l.states[0] + importance_floor * mean + 1e-12f;
            importance_.push_back(1 / lux);
        }
    }

    float spacingAt(glm::vec3 p) const {
        const auto& areas = rays_.scene().play_areas;
        const bool play = areas.empty() || std::ranges::any_of(areas, [&](const auto& a) { return a.contains(p); });
        return settings_.min_spacing_m * (play ? 1 : sparse_spacing);
    }

    bool add(uint32_t site, float spacing_m) {
        const glm::vec3 p = places_[site];
        if (near_.anySeen(rays_, p, spacing_m)) return false;
        near_.add(p);
        is_probe_[site] = true;
        probes_.push_back(site);
        levels_.push_back(static_cast<uint8_t>(level_));
        return true;
    }

    void placeCoarse() {
        for (uint32_t i = 0; i < first_corner_ && probes_.size() < limit_; ++i) add(i, coarse_spacing_m);
    }

    // The sites nearest to the points of a lattice, as many points as probes may be: as even as sites are.
    void placeLattice() {
        double spacing_m = std::cbrt(out_.free_volume_m3 / static_cast<double>(limit_));
        std::vector<uint32_t> chosen = latticeSites(spacing_m);
        for (; chosen.size() > limit_; chosen = latticeSites(spacing_m)) spacing_m *= 1.02;
        for (const uint32_t site : chosen) add(site, 0);
    }

    std::vector<uint32_t> latticeSites(double spacing_m) const {
        std::map<std::array<int, 3>, std::pair<float, uint32_t>> nearest;
        for (uint32_t i = 0; i < first_corner_; ++i) {
            const glm::dvec3 cell = glm::dvec3(places_[i]) / spacing_m;
            const auto distance = static_cast<float>(glm::distance(cell, glm::floor(cell) + 0.5));
            const glm::ivec3 c(glm::floor(cell));
            const auto [at, fresh] = nearest.try_emplace({c.x, c.y, c.z}, distance, i);
            if (!fresh && distance < at->second.first) at->second = {distance, i};
        }
        std::vector<uint32_t> sites;
        for (const auto& [cell, site] : nearest) sites.push_back(site.second);
        return sites;
    }

    Expected<void> build() {
        std::vector<glm::vec3> points;
        for (const uint32_t i : probes_) points.push_back(places_[i]);
        auto grid = tetrahedralise(points, {rays_.boundsMin(), rays_.boundsMax()});
        if (!grid) return std::unexpected(grid.error());
        out_.grid = std::move(*grid);
        std::ranges::copy(levels_, out_.grid.levels.begin());
        findSources();
        if (settings_.visibility) findVisibility();
        locateSites();
        return {};
    }

    // The site that a position is.
    uint32_t siteOf(uint32_t position) const {
        return position < probes_.size() ? probes_[position]
                                         : static_cast<uint32_t>(first_corner_ + position - probes_.size());
    }
    bool isFree(uint32_t position) const {
        return position < probes_.size() || corner_free_[position - probes_.size()];
    }

    void findSources() {
        const auto count = static_cast<uint32_t>(out_.grid.positions.size());
        out_.sources.resize(count);
        for (uint32_t i = 0; i < count; ++i) {
            out_.sources[i] = i;
            float nearest = std::numeric_limits<float>::infinity();
            for (uint32_t k = 0; k < count && !isFree(i); ++k) {
                const float distance = glm::distance(places_[siteOf(i)], places_[siteOf(k)]);
                if (isFree(k) && distance < nearest) nearest = distance, out_.sources[i] = k;
            }
        }
    }

    void locateSites() {
        out_.sites.resize(places_.size());
        place_.resize(places_.size());
        tbb::parallel_for(size_t{0}, places_.size(), [&](size_t i) {
            const glm::vec3 p = places_[i];
            const GridPlace place = locate(out_.grid, {p.x, p.y, p.z});
            FitSite& site = out_.sites[i];
            site.shares = probeWeights(out_.grid, place);
            site.importance = importance_[i];
            for (size_t k = 0; k < 4; ++k)
                site.probes[k] = out_.sources[out_.grid.tetrahedra[place.tetrahedron].probes[k]];
            place_[i] = place.tetrahedron;
        });
    }

    // Tetrahedra of earlier rounds keep what was found: by the sites that their probes are.
    using Key = std::array<uint32_t, 4>;
    Key keyOf(const Tetrahedron& t) const {
        return {siteOf(t.probes[0]), siteOf(t.probes[1]), siteOf(t.probes[2]), siteOf(t.probes[3])};
    }

    void findVisibility() {
        GlobalGrid& grid = out_.grid;
        grid.visibility.resize(grid.tetrahedra.size());
        std::vector<uint32_t> fresh;
        for (uint32_t t = 0; t < grid.tetrahedra.size(); ++t) {
            const auto found = seen_.find(keyOf(grid.tetrahedra[t]));
            if (found != seen_.end())
                grid.visibility[t] = found->second;
            else
                fresh.push_back(t);
        }
        tbb::parallel_for(size_t{0}, fresh.size(), [&](size_t i) {
            const Tetrahedron& t = grid.tetrahedra[fresh[i]];
            std::array<glm::vec3, 4> corners;
            std::array<bool, 4> free;
            for (size_t k = 0; k < 4; ++k) {
                corners[k] = vec(grid.positions[t.probes[k]]);
                free[k] = isFree(t.probes[k]);
            }
            grid.visibility[fresh[i]] = cook::findVisibility(rays_, corners, free);
        });
        for (const uint32_t t : fresh) seen_.emplace(keyOf(grid.tetrahedra[t]), grid.visibility[t]);
    }

    float errorOf(const FitValue& light, const FitValue& traced) const {
        float sum = 0;
        for (size_t state = 0; state < site_states; ++state)
            sum += gridError(&light[9 * state], &traced[9 * state], floor_lux_);
        return sum / site_states;
    }

    // With the light that probes would be given.
    void findErrors() {
        std::vector<FitValue> targets, probes;
        for (const SiteLight& l : out_.light) targets.push_back(l.states);
        for (uint32_t i = 0; i < out_.grid.positions.size(); ++i) probes.push_back(targets[siteOf(i)]);
        fitProbes(std::span(out_.sites).first(first_corner_), targets, probes);
        error_.resize(first_corner_);
        tbb::parallel_for(size_t{0}, first_corner_, [&](size_t i) {
            const FitSite& site = out_.sites[i];
            FitValue light{};
            for (size_t k = 0; k < 4; ++k)
                for (size_t c = 0; c < light.size(); ++c) light[c] += site.shares[k] * probes[site.probes[k]][c];
            error_[i] = is_probe_[i] ? 0 : errorOf(light, targets[i]);
        });
    }

    // The worst site of the worst tetrahedra. False when nothing is left to do.
    bool refine() {
        struct Cell {
            float sum = 0;
            std::vector<uint32_t> sites;
        };
        std::map<uint32_t, Cell> cells;
        for (uint32_t i = 0; i < first_corner_; ++i)
            if (error_[i] > settings_.tolerance) {
                cells[place_[i]].sum += error_[i];
                cells[place_[i]].sites.push_back(i);
            }
        std::vector<Cell*> order;
        for (auto& [t, cell] : cells) order.push_back(&cell);
        std::ranges::stable_sort(order, [](const Cell* a, const Cell* b) { return a->sum > b->sum; });
        const size_t before = probes_.size();
        const size_t most =
            std::min(limit_, before + std::max<size_t>(8, static_cast<size_t>(growth * static_cast<double>(before))));
        ++level_;
        for (Cell* cell : order) {
            std::ranges::stable_sort(cell->sites, [&](uint32_t a, uint32_t b) { return error_[a] > error_[b]; });
            for (const uint32_t i : cell->sites) {
                if (probes_.size() >= most) return true;
                if (add(i, spacingAt(places_[i]))) break;
            }
        }
        return probes_.size() > before;
    }

    const Sites& sites_;
    const GridSettings& settings_;
    Progress& progress_;
    const RayScene& rays_;
    Placement out_;
    size_t limit_ = 0;  // of probes
    float floor_lux_ = 0;
    uint32_t level_ = 0;
    std::vector<glm::vec3> places_;  // sites, the last 8 corners of the box
    size_t first_corner_ = 0;
    std::vector<bool> corner_free_;
    std::vector<float> importance_;  // per site
    std::vector<bool> is_probe_;     // per site but corners
    std::vector<uint32_t> probes_;   // sites
    std::vector<uint8_t> levels_;    // of probes_
    Neighbourhood near_;
    std::map<Key, TetrahedronVisibility> seen_;
    std::vector<uint32_t> place_;  // per site: its tetrahedron
    std::vector<float> error_;     // per site but corners
};

}  // namespace

Expected<Placement> placeProbes(const Sites& sites, const GridSettings& settings, Progress& progress) {
    return Placer(sites, settings, progress).run();
}

}  // namespace dimmer::cook
