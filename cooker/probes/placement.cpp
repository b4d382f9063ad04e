#include <probes/placement.h>

#include <bake/sampling.h>
#include <probes/neighbourhood.h>
#include <probes/trial_grid.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace dimmer::cook {
namespace {

constexpr float coarse_spacing_m = 4;  // of the first probes, where they may be as near as that
constexpr float sparse_spacing = 2;    // outside of play areas
// Of the number of probes in a round, at most: where there are few, each counts.
constexpr double growth_of_few = 0.3, growth_of_many = 0.45;
constexpr size_t few_probes_to_grow = 1000;
constexpr uint32_t grow_rounds_max = 64;
// Few probes are judged at as many places each as all of them are in the end, and this many times more, but not at
// fewer than so many.
constexpr double places_to_spare = 1.5;
constexpr size_t places_min = 8000;
// The more sites there are to a probe, the more rounds of exchange find better ones among them; among thousands of
// probes a round takes a second and mends half a hundredth of the error or nothing.
constexpr size_t sites_per_exchange = 3, exchange_rounds_max = 16, exchanges_times_probes = 1000;
constexpr size_t exchange_part = 5;  // one in so many is exchanged
// Where there are few probes each of them counts, and a trial costs little: some 5 ms with sixty of them. With more
// there are fewer moves; among thousands a handful would tell nothing.
constexpr size_t moves_max = 400, moves_times_probes = 24000, moves_min = 40;
constexpr uint32_t draws_per_move = 3;  // some are not allowed
constexpr size_t worst_places = 200;    // where a moving probe may be needed
constexpr size_t idle_part = 3;         // one in so many probes, those that do least, may be called there
constexpr float share_at_place = 0.1f;  // of a probe at a place that is near by

class Placer {
   public:
    Placer(const RayScene& rays, const SiteChoice& choice, std::span<const FitValue> states,
           const GridSettings& settings, Progress& progress)
        : settings_(settings),
          progress_(progress),
          rays_(rays),
          limit_(choice.probes_max),
          free_volume_m3_(choice.free_volume_m3),
          order_(siteOrder(choice.blocks)),
          trial_(rays, choice, states, settings),
          places_(trial_.places()),
          near_(cellSide()) {}

    Expected<Placement> run() {
        settings_.uniform ? placeLattice() : placeCoarse();
        if (auto ok = settings_.uniform ? build() : buildToGrow(); !ok) return std::unexpected(ok.error());
        if (!settings_.uniform) {
            progress_.stage("probe placement", exchangeRounds() + 2);
            if (auto ok = growFirst(); !ok) return std::unexpected(ok.error());
            if (auto ok = exchange(); !ok) return std::unexpected(ok.error());
            if (auto ok = moveAbout(); !ok) return std::unexpected(ok.error());
        }
        const std::vector<ProbesError> errors = errorsOfFewer();
        Placement placement = trial_.take();
        placement.errors = errors;
        return placement;
    }

   private:
    Expected<void> build() { return trial_.build(probes_, trial_.placeCount()); }
    Expected<void> buildToGrow() {
        const double share = static_cast<double>(probes_.places.size()) / static_cast<double>(limit_);
        const auto places = static_cast<size_t>(places_to_spare * share * static_cast<double>(trial_.placeCount()));
        return trial_.build(probes_, std::min(std::max(places, places_min), trial_.placeCount()));
    }

    Expected<void> growFirst() {
        note();
        const auto grown = grow([this] { note(); });
        note();
        return grown;
    }
    void note() { errors_.push_back({static_cast<uint32_t>(probes_.places.size()), toFloat(trial_.meanError())}); }

    // Fewer probes would be exchanged and moved as well: what that made of all of them it is taken to make of fewer.
    std::vector<ProbesError> errorsOfFewer() const {
        std::vector<ProbesError> errors;
        if (errors_.empty() || !(errors_.back().error > 0)) return errors;
        const float mended = toFloat(trial_.meanError()) / errors_.back().error;
        for (ProbesError e : errors_) {
            e.error *= mended;
            if (errors.empty() || e.probes > errors.back().probes)
                errors.push_back(e);
            else
                errors.back() = e;  // the last word, from more places
        }
        return errors;
    }
    static float toFloat(double v) { return static_cast<float>(v); }

    Expected<void> grow() {
        return grow([] {});
    }
    // Adds probes until they are as many as may be, or nothing is wrong.
    template <class Noted>
    Expected<void> grow(Noted&& noted) {
        bool at_all = false;  // once few places show nothing wrong
        for (uint32_t round = 0; round < grow_rounds_max && probes_.places.size() < limit_; ++round) {
            const bool grown = refine();
            if (!grown && trial_.looksAtAll()) break;
            at_all = at_all || !grown;
            if (auto ok = at_all ? build() : buildToGrow(); !ok) return ok;
            noted();
        }
        progress_.advance(1);
        return trial_.looksAtAll() ? Expected<void>{} : build();
    }

    // Again and again, a fifth of the probes that do least go, and others come where they are needed more; the best
    // set that was seen stays.
    Expected<void> exchange() {
        ChosenProbes best = probes_;
        double least = trial_.meanError();
        for (size_t round = 0; round < exchangeRounds(); ++round) {
            thinOut();
            if (auto ok = build(); !ok) return ok;
            if (auto ok = grow(); !ok) return ok;
            if (!(trial_.meanError() < least)) continue;
            least = trial_.meanError();
            best = probes_;
        }
        take(std::move(best));
        return build();
    }

    size_t exchangeRounds() const {
        return std::min(
            {exchange_rounds_max, trial_.placeCount() / limit_ / sites_per_exchange, exchanges_times_probes / limit_});
    }

    // Those that do least go, but for those that are the only ones in sight of somewhere.
    void thinOut() {
        const std::vector<uint32_t> order = leastUsefulFirst();
        const auto leave = order.begin() + static_cast<std::ptrdiff_t>(order.size() / exchange_part);
        Neighbourhood staying(cellSide());
        for (auto i = leave; i != order.end(); ++i) staying.add(places_[probes_.places[*i]]);
        std::vector<uint32_t> kept(leave, order.end());
        for (auto i = leave; i != order.begin();) {
            const glm::vec3 p = places_[probes_.places[*--i]];
            if (staying.anySeen(rays_, p, coarseSpacingAt(p))) continue;
            staying.add(p);
            kept.push_back(*i);
        }
        std::ranges::sort(kept);
        ChosenProbes remaining;
        for (const uint32_t i : kept) {
            remaining.places.push_back(probes_.places[i]);
            remaining.levels.push_back(probes_.levels[i]);
        }
        take(std::move(remaining));
    }

    std::vector<uint32_t> leastUsefulFirst() const {
        const std::vector<float> useful = trial_.usefulness();
        std::vector<uint32_t> order(useful.size());
        std::iota(order.begin(), order.end(), 0u);
        std::ranges::stable_sort(order, {}, [&](uint32_t i) { return useful[i]; });
        return order;
    }

    void take(ChosenProbes probes) {
        probes_ = std::move(probes);
        near_ = Neighbourhood(cellSide());
        for (const uint32_t i : probes_.places) near_.add(places_[i]);
    }

    // Single probes move, by turns to places near by and to where they are needed more; what helps stays.
    Expected<void> moveAbout() {
        double least = trial_.meanError();
        const size_t moves = movesToTry();
        size_t tried = 0;
        for (uint32_t move = 0; move < draws_per_move * moves && tried < moves && anythingWrong(); ++move) {
            const ChosenProbes before = probes_;
            if (!(move % 2 == 0 ? moveNearby(move) : moveWhereNeeded(move))) continue;
            ++tried;
            TrialGrid::Result result = trial_.result();
            if (auto ok = build(); !ok) return ok;
            if (trial_.meanError() < least) {
                least = trial_.meanError();
            } else {
                probes_ = before;
                trial_.restore(before, std::move(result));
            }
        }
        progress_.advance(1);
        return {};
    }

    size_t movesToTry() const {
        const size_t moves = std::min(moves_max, moves_times_probes / std::max<size_t>(probes_.places.size(), 1));
        return moves < moves_min ? 0 : moves;
    }

    bool anythingWrong() const { return std::ranges::max(trial_.result().errors) > settings_.tolerance; }

    bool moveNearby(uint32_t move) {
        const uint32_t probe = hash(move, 1) % static_cast<uint32_t>(probes_.places.size());
        std::vector<uint32_t> candidates;
        for (uint32_t i = 0; i < trial_.placeCount(); ++i) {
            const FitSite& site = trial_.result().placement.sites[i];
            for (size_t k = 0; k < 4; ++k)
                if (site.probes[k] == probe && site.shares[k] > share_at_place) candidates.push_back(i);
        }
        return !candidates.empty() && moveTo(probe, candidates[hash(move, 2) % candidates.size()]);
    }

    bool moveWhereNeeded(uint32_t move) {
        const auto order = leastUsefulFirst();
        const uint32_t probe = order[hash(move, 1) % (order.size() / idle_part + 1)];
        const auto& errors = trial_.result().errors;
        std::vector<uint32_t> worst(trial_.placeCount());
        std::iota(worst.begin(), worst.end(), 0u);
        const size_t count = std::min(worst_places, worst.size());
        std::ranges::partial_sort(worst, worst.begin() + static_cast<std::ptrdiff_t>(count), {},
                                  [&](uint32_t i) { return std::pair(-errors[i], i); });
        return moveTo(probe, worst[hash(move, 2) % count]);
    }

    // Not so near to another one that they see, and not where that leaves somewhere without any in sight.
    bool moveTo(uint32_t probe, uint32_t place) {
        Neighbourhood others(cellSide());
        for (uint32_t i = 0; i < probes_.places.size(); ++i)
            if (i != probe) others.add(places_[probes_.places[i]]);
        const glm::vec3 to = places_[place], from = places_[probes_.places[probe]];
        if (others.anySeen(rays_, to, spacingAt(to))) return false;
        others.add(to);
        if (!others.anySeen(rays_, from, coarseSpacingAt(from))) return false;
        probes_.places[probe] = place;
        return true;
    }

    float spacingAt(glm::vec3 p) const {
        const auto& areas = rays_.scene().play_areas;
        const bool play = areas.empty() || std::ranges::any_of(areas, [&](const auto& a) { return a.contains(p); });
        return settings_.min_spacing_m * (play ? 1 : sparse_spacing);
    }

    // Between the first probes. So near to any place, some probe is in sight.
    float coarseSpacingAt(glm::vec3 p) const { return std::max(coarse_spacing_m, spacingAt(p)); }

    // No distance that is asked for is longer.
    float cellSide() const { return std::max(coarse_spacing_m, sparse_spacing * settings_.min_spacing_m); }

    bool add(uint32_t place, float spacing_m) {
        const glm::vec3 p = places_[place];
        if (near_.anySeen(rays_, p, spacing_m)) return false;
        near_.add(p);
        probes_.places.push_back(place);
        probes_.levels.push_back(static_cast<uint8_t>(std::min(level_, 255u)));
        return true;
    }

    // From places all over the level, and those at surfaces, before those near lamps, which would crowd there.
    void placeCoarse() {
        std::vector<uint32_t> by_block(trial_.placeCount());
        std::iota(by_block.begin(), by_block.end(), 0u);
        std::ranges::stable_sort(by_block, {}, [&](uint32_t i) { return order_[i].block; });
        for (const uint32_t i : by_block)
            if (probes_.places.size() < limit_) add(i, coarseSpacingAt(places_[i]));
    }

    // The sites nearest to the points of a lattice, as many points as probes may be: as even as sites are.
    void placeLattice() {
        double spacing_m = std::cbrt(free_volume_m3_ / static_cast<double>(limit_));
        std::vector<uint32_t> chosen = latticeSites(spacing_m);
        for (; chosen.size() > limit_; chosen = latticeSites(spacing_m)) spacing_m *= 1.02;
        for (const uint32_t site : chosen) add(site, 0);
    }

    std::vector<uint32_t> latticeSites(double spacing_m) const {
        std::map<std::array<int, 3>, std::pair<float, uint32_t>> nearest;
        for (uint32_t i = 0; i < trial_.placeCount(); ++i) {
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

    // The worst site of the worst tetrahedra. False when nothing is left to do.
    bool refine() {
        struct Cell {
            float sum = 0;
            std::vector<uint32_t> sites;
        };
        const auto& [placement, at, errors] = trial_.result();
        std::map<uint32_t, Cell> cells;
        for (uint32_t i = 0; i < errors.size(); ++i)
            if (errors[i] > settings_.tolerance) {
                Cell& cell = cells[at[i].tetrahedron];
                cell.sum += errors[i];
                cell.sites.push_back(i);
            }
        std::vector<Cell*> order;
        for (auto& [t, cell] : cells) order.push_back(&cell);
        std::ranges::stable_sort(order, [](const Cell* a, const Cell* b) { return a->sum > b->sum; });
        const size_t before = probes_.places.size();
        const double growth = limit_ <= few_probes_to_grow ? growth_of_few : growth_of_many;
        const size_t most =
            std::min(limit_, before + std::max<size_t>(8, static_cast<size_t>(growth * static_cast<double>(before))));
        ++level_;
        for (Cell* cell : order) {
            std::ranges::stable_sort(cell->sites, {}, [&](uint32_t i) { return -errors[i]; });
            for (const uint32_t i : cell->sites) {
                if (probes_.places.size() >= most) return true;
                if (add(i, spacingAt(places_[i]))) break;
            }
        }
        return probes_.places.size() > before;
    }

    const GridSettings& settings_;
    Progress& progress_;
    const RayScene& rays_;
    size_t limit_;  // of probes
    double free_volume_m3_;
    const std::vector<SiteRow> order_;  // of places_
    TrialGrid trial_;
    const std::vector<glm::vec3>& places_;
    uint32_t level_ = 0;
    ChosenProbes probes_;
    Neighbourhood near_;               // of probes_
    std::vector<ProbesError> errors_;  // as it grew
};

}  // namespace

Expected<Placement> placeProbes(const RayScene& rays, const SiteChoice& choice, std::span<const FitValue> states,
                                const GridSettings& settings, Progress& progress) {
    return Placer(rays, choice, states, settings, progress).run();
}

}  // namespace dimmer::cook
