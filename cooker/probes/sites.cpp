#include <probes/sites.h>

#include <bake/direct.h>
#include <bake/final_gather.h>
#include <bake/sampling.h>
#include <probes/free_space.h>
#include <probes/tetrahedra.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string_view>

namespace dimmer::cook {
namespace {

// On average over the free space: the grid need not be denser to be as right as lightmaps are.
constexpr double density_max_per_m3 = 1;
// Small levels can have more sites, and need them, as single probes matter; large ones cannot pay for all that are
// asked.
constexpr double small_sites_per_probe = 40, small_sites = 4000;
constexpr double many_sites = 60000, sites_per_probe_affordable = 5;
constexpr uint32_t first_look = 8192;  // places that tell how much of the level is free
constexpr uint32_t tries_per_site = 64;
// Half of the places are near a lamp, where light changes over a hand's breadth: nearer than this many times the
// spacing of the others, so that what lies around that is not left to chance.
constexpr double share_near_lamps = 0.5;
constexpr double lamp_reach_spacings = 2.2;
constexpr float lamp_reach_min_m = 0.8f;
// Light changes over lengths like the distance to surfaces (Ward and Heckbert 1992), and what asks for it moves near
// them: places farther off than this many times the mean spacing of probes become rarer.
constexpr double near_spacings = 0.8;
constexpr uint32_t rarity_seed = 0x2c1b3c6du;
// Small levels get up to four times the rays from each place, while all of them are no more than so many places' usual
// ones: noise misleads where to put the few probes they have.
constexpr uint32_t small_level_places = 15625, small_level_factor = 4;
constexpr size_t sites_per_task = 64;
constexpr uint32_t site_seed = 0x51ed270bu;
// Of a light set, beside always-on light: sets are off at times.
constexpr float weight_of_sets = 0.05f;

class Chooser {
   public:
    Chooser(const RayScene& rays, const GridSettings& settings, GroupStore* store)
        : rays_(rays), settings_(settings), store_(store) {
        out_.air = airBox(rays);
        for (const PunctualLight& light : rays.scene().lights)
            if (light.type != LightType::Directional && light.bake != BakeMode::None &&
                std::ranges::find(lamps_, light.position_m) == lamps_.end())
                lamps_.push_back(light.position_m);
    }

    Expected<SiteChoice> run() {
        const uint32_t wanted = decideCounts();
        const uint32_t affordable =
            std::clamp(small_level_places * settings_.site_rays / std::max(wanted, 1u), settings_.site_rays,
                       small_level_factor * settings_.site_rays);
        const uint32_t rays = (affordable + 1) / 2 * 2;  // in two halves
        const auto at_lamps = lamps_.empty() ? 0 : static_cast<uint32_t>(share_near_lamps * wanted);
        out_.blocks.push_back({allOver(wanted - at_lamps), rays});
        const auto lamps = static_cast<uint32_t>(lamps_.size());
        for (const glm::vec3 lamp : lamps_)
            if (const uint32_t count = (at_lamps + lamps - 1) / lamps; count > 0)
                out_.blocks.push_back({around(lamp, count), rays});
        if (std::ranges::all_of(out_.blocks, [](const SiteBlock& block) { return block.places_m.empty(); }))
            return std::unexpected(Error{
                ErrorCode::BadInput,
                "no place in the level's box, nor in its play areas, is in the open: where most of what is around is "
                "the back of a surface, or one is within 5 cm, no probe can stand"});
        auto corners = freeCorners();
        if (!corners) return std::unexpected(corners.error());
        out_.blocks.push_back({std::move(*corners), rays});
        return std::move(out_);
    }

   private:
    // Of sites wanted.
    uint32_t decideCounts() {
        const auto free = remembered({static_cast<float>(first_look)}, [&] {
            return chosen(
                0, first_look, [&](uint32_t i) { return anywhere(i); },
                [&](glm::vec3 p, uint32_t) { return inTheOpen(rays_, p); });
        });
        const glm::dvec3 size = glm::dvec3(out_.air.max_m) - glm::dvec3(out_.air.min_m);
        out_.free_volume_m3 = static_cast<double>(free.size()) / first_look * size.x * size.y * size.z;
        // The box's corners are probes too.
        const double probes = std::floor(std::min(std::max(density_max_per_m3 * out_.free_volume_m3 - 8, 8.0),
                                                  static_cast<double>(settings_.probes_max)));
        out_.probes_max = static_cast<size_t>(probes);
        const double least = std::min(small_sites_per_probe * probes, small_sites);
        const double most = std::max(many_sites, sites_per_probe_affordable * probes);
        const double wanted = std::clamp(settings_.sites * probes, least, most);
        const double spacing_m = std::cbrt(out_.free_volume_m3 / ((1 - share_near_lamps) * wanted));
        near_m_ = settings_.uniform || free.empty()
                      ? far_away_m
                      : static_cast<float>(near_spacings * std::cbrt(out_.free_volume_m3 / probes));
        lamp_reach_m_ = std::max(lamp_reach_min_m, static_cast<float>(lamp_reach_spacings * spacing_m));
        return static_cast<uint32_t>(wanted);
    }

    glm::vec3 anywhere(uint32_t i) const {
        const glm::vec3 low = out_.air.min_m, size = out_.air.max_m - low;
        return low + size * glm::vec3(radicalInverse(2, i + 1), radicalInverse(3, i + 1), radicalInverse(5, i + 1));
    }
    // Uniform in the distance, so that each shell around a lamp gets as many (but for what is far from surfaces): light
    // there falls with its square.
    glm::vec3 nearLamp(glm::vec3 lamp_m, uint32_t i) const {
        const glm::vec3 u = sequence3d(i, site_seed);
        return lamp_m + lamp_reach_m_ * u.z * uniformSphereDirection({u.x, u.y});
    }

    std::vector<glm::vec3> allOver(uint32_t count) const {
        return sites({static_cast<float>(count), near_m_}, count, [&](uint32_t i) { return anywhere(i); });
    }
    std::vector<glm::vec3> around(glm::vec3 lamp_m, uint32_t count) const {
        return sites({static_cast<float>(count), near_m_, lamp_reach_m_, lamp_m.x, lamp_m.y, lamp_m.z}, count,
                     [&](uint32_t i) { return nearLamp(lamp_m, i); });
    }
    std::vector<glm::vec3> sites(const std::vector<float>& what, uint32_t count, auto&& at) const {
        return remembered(what, [&] {
            return first(count, at, [&](glm::vec3 p, uint32_t i) {
                return p == glm::clamp(p, out_.air.min_m, out_.air.max_m) &&
                       chosenInTheOpen(rays_, p, near_m_, unitFloat(hash(i, rarity_seed)));
            });
        });
    }

    // What an earlier cook found of the same. `what`: all that it depends on besides the level's geometry.
    std::vector<glm::vec3> remembered(std::vector<float> what, auto&& find) const {
        for (const glm::vec3 corner : {out_.air.min_m, out_.air.max_m})
            what.insert(what.end(), {corner.x, corner.y, corner.z});
        if (store_)
            if (auto places = store_->findPlaces(what)) return std::move(*places);
        const std::vector<glm::vec3> places = find();
        if (store_) store_->keepPlaces(what, places);
        return places;
    }

    // Of `count` places those that are `wanted`, in their order.
    static std::vector<glm::vec3> chosen(uint32_t begin, uint32_t count, auto&& at, auto&& wanted) {
        std::vector<uint8_t> is_wanted(count);
        tbb::parallel_for(0u, count, [&](uint32_t i) { is_wanted[i] = wanted(at(begin + i), begin + i); });
        std::vector<glm::vec3> places;
        for (uint32_t i = 0; i < count; ++i)
            if (is_wanted[i]) places.push_back(at(begin + i));
        return places;
    }

    // The first `count` that are wanted of at most so many times as many.
    static std::vector<glm::vec3> first(uint32_t count, auto&& at, auto&& wanted) {
        std::vector<glm::vec3> places;
        const uint32_t tries = tries_per_site * count;
        for (uint32_t tried = 0; places.size() < count && tried < tries;) {
            const uint32_t block = std::min(std::clamp(count, 64u, 4096u), tries - tried);
            for (const glm::vec3 p : chosen(tried, block, at, wanted))
                if (places.size() < count) places.push_back(p);
            tried += block;
        }
        return places;
    }

    Expected<std::vector<glm::vec3>> freeCorners() {
        const auto box = tetrahedralise({}, out_.air);
        if (!box) return std::unexpected(box.error());
        std::vector<glm::vec3> corners;
        for (const ProbePosition& p : box->positions) {
            const glm::vec3 corner(p.x_m, p.y_m, p.z_m);
            out_.corner_free.push_back(inTheOpen(rays_, corner));
            if (out_.corner_free.back()) corners.push_back(corner);
        }
        return corners;
    }

    const RayScene& rays_;
    const GridSettings& settings_;
    GroupStore* store_;
    std::vector<glm::vec3> lamps_;
    float lamp_reach_m_ = 0, near_m_ = 0;
    SiteChoice out_;
};

// Light at places, of some groups. One worker's scratch.
class PlaceTrace {
   public:
    PlaceTrace(const Gatherer& gatherer, const LightGrid& lights, const SparseLight& radiance,
               std::span<const TermReport> reports, const BakeSettings& settings, std::span<const uint8_t> groups)
        : gatherer_(gatherer),
          lights_(lights),
          radiance_(radiance),
          reports_(reports),
          settings_(settings),
          sum_(gatherer.paths().termCount()),
          direct_(gatherer.paths().termCount()),
          full_(gatherer.paths().termCount()),
          first_half_lux_(gatherer.paths().termCount()),
          wanted_in_group_(gatherer.paths().groupCount()) {
        for (uint32_t t = 0; t < gatherer.paths().termCount(); ++t) {
            const uint32_t group = gatherer.paths().terms()[t].group;
            sum_.setWanted(t, groups[group] != 0);
            full_.setWanted(t, groups[group] != 0);
            wanted_in_group_[group] += groups[group];
        }
    }

    // Adds what is active there, ascending, with the noise that two halves of an even number of rays tell. `ends`: of
    // the rays, as GatherOptions::row. Returns the rays traced.
    uint64_t trace(glm::vec3 place, uint32_t rays, RowEnds* ends, std::vector<ProbeTermLight>& row) {
        const SamplePoint point{place, no_face};
        // A place has noise of its own wherever it stands in whatever list.
        uint32_t seed = site_seed;
        for (int c = 0; c < 3; ++c) seed = hash(seed, std::bit_cast<uint32_t>(place[c]));
        const GatherFrom from = Gatherer::atProbe(point, seed);
        const uint64_t shadow_rays = directLight(gatherer_, lights_, from, direct_, full_);
        const bool known = ends && ends->ends[0] != RayEnd::unknown;
        for (const uint32_t first_ray : {0u, rays / 2}) {
            gatherer_.gather(from,
                             {.rays = rays / 2,
                              .emitter_samples = settings_.emitter_samples * rays / 2 / rays_per_round,
                              .seed = settings_.seed + 2,
                              .first_ray = first_ray,
                              .wanted_in_group = wanted_in_group_,
                              .row = ends},
                             &radiance_, sum_, nullptr);
            if (first_ray > 0) continue;
            for (const uint32_t t : sum_.touched()) first_half_lux_[t] = luminance(sum_[t].irradiance());
        }
        if (sum_.wants(always_group)) sum_[always_group];  // every site has some
        for (auto* direct : {&direct_, &full_})
            for (const uint32_t t : direct->touched())
                if (sum_.wants(t)) sum_[t];
        row.reserve(sum_.touched().size());
        for (const uint32_t t : sum_.touched()) {
            if (!sum_.wants(t)) continue;
            ProbeLight light = sum_[t] * 0.5f;  // of two halves
            const float off = first_half_lux_[t] - luminance(light.irradiance());
            first_half_lux_[t] = 0;
            light += full_[t];
            const float lux = luminance(light.irradiance());
            if (isActive(reports_[t], t, luminance(direct_[t].irradiance()), lux))
                row.push_back({t, light, off * off, 0});
        }
        sum_.clear();
        direct_.clear();
        full_.clear();
        return shadow_rays + (known ? 0 : rays);
    }

   private:
    const Gatherer& gatherer_;
    const LightGrid& lights_;
    const SparseLight& radiance_;
    std::span<const TermReport> reports_;
    const BakeSettings& settings_;
    TermAccumulator<ProbeLight> sum_, direct_, full_;  // the last: direct light of lamps that are baked in full
    std::vector<float> first_half_lux_;  // per term, of what rays found; 0 between places
    std::vector<uint32_t> wanted_in_group_;
};

// Light of some groups alone: rays of single groups, whose ends are known, do little else than read it.
SparseLight ofGroups(const SparseLight& light, std::span<const Term> terms, std::span<const uint8_t> groups) {
    return SparseLight::build(light.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<TermLight> row;
        for (size_t i = begin; i < end; ++i) {
            row.clear();
            for (const TermLight& l : light.row(i))
                if (groups[terms[l.term].group]) row.push_back(l);
            emit(std::span<const TermLight>(row));
        }
    });
}

// Where the rays of blocks of places end: what a store knows, and what it is to know.
class SiteRays {
   public:
    SiteRays(std::span<const SiteBlock> all, std::span<const size_t> blocks, GroupStore* store, uint32_t receivers,
             uint32_t paths)
        : all_(all), store_(store), known_(all.size()), fresh_(all.size()) {
        for (const size_t b : blocks) {
            const size_t places = all[b].places_m.size();
            if (!store) break;
            if (auto found = store->findRays("places", all[b].places_m, places, receivers, paths))
                known_[b] = std::move(*found);
            else
                fresh_[b] = RayEnds(places, receivers, paths);
        }
    }
    // Of some places of a block in a row, as putBlock() takes them. Empty: none are to be remembered. As take(), for
    // different places at the same time.
    void get(size_t block, size_t begin, size_t end, std::vector<RowEnds>& rows) const {
        rows.resize(store_ ? end - begin : 0);
        for (size_t i = 0; i < rows.size(); ++i) {
            rows[i].clear();
            if (known_[block].rows() > 0) known_[block].get(begin + i, rows[i]);
            if (rows[i].ends.size() == all_[block].rays) continue;
            rows[i].clear();
            rows[i].ends.assign(all_[block].rays, RayEnd::unknown);
        }
    }
    void take(size_t block, size_t begin, std::span<const RowEnds> rows) {
        if (fresh_[block].rows() > 0) fresh_[block].putBlock(begin / rows_per_block, rows);
    }
    void keep() {
        for (size_t b = 0; b < all_.size(); ++b)
            if (fresh_[b].rows() > 0) store_->keepRays("places", all_[b].places_m, fresh_[b]);
    }

   private:
    std::span<const SiteBlock> all_;
    GroupStore* store_;
    std::vector<RayEnds> known_, fresh_;  // per block
};

// Of each group over the rows that count: light that it sends, and how many it reaches.
struct GroupSums {
    std::vector<double> lux, rows;
};
GroupSums sumsOfGroups(const Sparse<ProbeTermLight>& light, std::span<const Term> terms, uint32_t groups,
                       auto&& counts) {
    GroupSums sums{std::vector<double>(groups), std::vector<double>(groups)};
    for (size_t i = 0; i < light.rows(); ++i) {
        if (!counts(i)) continue;
        for (const ProbeTermLight& l : light.row(i)) {
            const Term& term = terms[l.term];
            if (!term.free()) continue;
            const auto lux = static_cast<double>(luminance(l.light.irradiance()));
            sums.lux[term.group] += lux;
            sums.rows[term.group] += lux > 0;
        }
    }
    return sums;
}

// Per group a number: always-on light's is 0, and sets taken apart (pipeline/lamps_apart.h) have one for all parts.
std::vector<uint32_t> wholesOf(const Scene& scene) {
    std::vector<uint32_t> wholes = {0};
    std::map<std::string_view, uint32_t> numbers;
    for (const SceneLightSet& set : scene.light_sets) {
        const auto fresh = static_cast<uint32_t>(1 + numbers.size());
        const std::string_view name = set.part_of.empty() ? set.name : set.part_of;
        wholes.push_back(set.always_on ? 0 : numbers.try_emplace(name, fresh).first->second);
    }
    return wholes;
}

// Of what is taken apart all parts together count as one whole.
std::vector<float> weightsOfGroups(std::span<const uint32_t> wholes, const Sparse<ProbeTermLight>& light,
                                   std::span<const Term> terms, std::span<const SiteRow> order) {
    const auto groups = static_cast<uint32_t>(wholes.size());
    GroupSums sums = sumsOfGroups(light, terms, groups, [&](size_t i) { return order[i].block == 0; });
    if (std::ranges::max(sums.lux) == 0) sums = sumsOfGroups(light, terms, groups, [](size_t) { return true; });
    std::vector<float> parts(groups);  // per whole: that have light
    for (uint32_t g = 0; g < groups; ++g) parts[wholes[g]] += sums.lux[g] > 0 ? 1 : 0;
    std::vector<float> weights(groups);
    for (uint32_t g = 0; g < groups; ++g)
        if (sums.lux[g] > 0)
            weights[g] = static_cast<float>(sums.rows[g] / sums.lux[g]) * (wholes[g] == 0 ? 1 : weight_of_sets) /
                         parts[wholes[g]];
    return weights;
}

}  // namespace

std::vector<SiteRow> siteOrder(std::span<const SiteBlock> blocks) {
    std::vector<SiteRow> order;
    if (blocks.empty()) return order;
    for (size_t b = 0; b + 1 < blocks.size(); ++b)
        for (size_t i = 0; i < blocks[b].places_m.size(); ++i) order.push_back({b, i});
    std::ranges::stable_sort(order, {}, [&](const SiteRow& r) {
        return (static_cast<double>(r.row) + 0.5) / static_cast<double>(blocks[r.block].places_m.size());
    });
    for (size_t i = 0; i < blocks.back().places_m.size(); ++i) order.push_back({blocks.size() - 1, i});
    return order;
}

std::vector<glm::vec3> SiteChoice::places() const {
    std::vector<glm::vec3> all;
    for (const SiteRow& r : siteOrder(blocks)) all.push_back(blocks[r.block].places_m[r.row]);
    return all;
}

Expected<SiteChoice> chooseSites(const RayScene& rays, const GridSettings& settings, GroupStore* store) {
    return Chooser(rays, settings, store).run();
}

SiteLight::SiteLight(std::span<const SiteBlock> blocks, const DoorPaths& paths, GroupStore* store)
    : blocks_(blocks),
      paths_(paths),
      store_(store),
      light_(paths.groupCount(), std::vector<Sparse<ProbeTermLight>>(blocks.size())) {
    for (uint32_t g = 0; store && g < paths.groupCount(); ++g) {
        light_[g] = store->findSites(g, blocks);
        for (size_t b = 0; b < blocks.size(); ++b)
            if (!fits(light_[g][b], blocks[b].places_m.size(), paths.termsOf(g).size())) light_[g][b] = {};
    }
}

std::vector<uint8_t> SiteLight::asked() const {
    std::vector<uint8_t> groups(light_.size());
    for (uint32_t g = 0; g < light_.size(); ++g)
        for (size_t b = 0; b < blocks_.size(); ++b)
            if (!blocks_[b].places_m.empty() && isMissing(g, b)) groups[g] = 1;
    return groups;
}

// Groups, ascending.
std::vector<uint32_t> SiteLight::missingAt(size_t block) const {
    std::vector<uint32_t> groups;
    for (uint32_t g = 0; g < light_.size() && !blocks_[block].places_m.empty(); ++g)
        if (isMissing(g, block)) groups.push_back(g);
    return groups;
}

// Of one block and group, from what was traced at the block's places, whose rows ascend by group.
Sparse<ProbeTermLight> SiteLight::ofGroup(std::span<const Row> rows, uint32_t group) const {
    return Sparse<ProbeTermLight>::build(rows.size(), [&](size_t begin, size_t end, auto emit) {
        Row row;
        for (size_t i = begin; i < end; ++i) {
            row.clear();
            for (const ProbeTermLight& l :
                 std::ranges::equal_range(rows[i], group, {}, [&](const auto& of) { return groupOf(of); }))
                row.push_back({paths_.numberInGroup(l.term), l.light, l.variance, 0});
            emit(std::span<const ProbeTermLight>(row));
        }
    });
}

uint64_t SiteLight::trace(const Gatherer& gatherer, const SparseLight& radiance, std::span<const TermReport> reports,
                          const BakeSettings& settings, Progress& progress) {
    const auto asked_groups = asked();
    if (std::ranges::count(asked_groups, 1) == 0) return 0;
    const LightGrid lights(gatherer.rays(), settings.light_grid, asked_groups, &progress);
    // Blocks that miss the same groups are traced together: most often all of them.
    std::map<std::vector<uint32_t>, std::vector<size_t>> passes;
    for (size_t b = 0; b < blocks_.size(); ++b)
        if (auto missing = missingAt(b); !missing.empty()) passes[std::move(missing)].push_back(b);
    std::atomic<uint64_t> traced = 0;
    for (const auto& [groups, blocks] : passes) {
        std::vector<uint8_t> wanted(light_.size());
        for (const uint32_t g : groups) wanted[g] = 1;
        struct Part {
            size_t block, begin, end;  // of its places
            size_t first;              // of all
        };
        std::vector<Part> parts;
        size_t places = 0;
        for (const size_t b : blocks)
            for (size_t begin = 0, count = blocks_[b].places_m.size(); begin < count; begin += rows_per_block) {
                const size_t end = std::min(begin + rows_per_block, count);
                parts.push_back({b, begin, end, places});
                places += end - begin;
            }
        const bool all = std::ranges::count(wanted, 0) == 0;
        const SparseLight some = all ? SparseLight() : ofGroups(radiance, paths_.terms(), wanted);
        SiteRays rays(blocks_, blocks, store_, static_cast<uint32_t>(gatherer.receiverCount()), paths_.pathCount());
        progress.stage("light at probe sites", places);
        std::vector<Row> rows(places);
        tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
            const auto& [b, begin, end, first] = parts[p];
            std::vector<RowEnds> ends;
            rays.get(b, begin, end, ends);
            tbb::parallel_for(tbb::blocked_range<size_t>(0, end - begin, sites_per_task), [&](const auto& range) {
                PlaceTrace trace(gatherer, lights, all ? radiance : some, reports, settings, wanted);
                for (size_t i = range.begin(); i < range.end(); ++i)
                    traced += trace.trace(blocks_[b].places_m[begin + i], blocks_[b].rays,
                                          ends.empty() ? nullptr : &ends[i], rows[first + i]);
            });
            rays.take(b, begin, ends);
            progress.advance(end - begin);
        });
        rays.keep();
        share(rows, blocks, groups);
    }
    return traced;
}

// Gives the rows' memory back as it goes: with hundreds of sets in sight of each other they are gigabytes.
void SiteLight::share(std::span<Row> rows, std::span<const size_t> blocks, std::span<const uint32_t> groups) {
    for (const size_t b : blocks) {
        const auto here = rows.first(blocks_[b].places_m.size());
        rows = rows.subspan(here.size());
        tbb::parallel_for(size_t{0}, here.size(), [&](size_t i) {
            std::ranges::sort(here[i], {}, [&](const auto& of) { return std::pair(groupOf(of), of.term); });
        });
        for (const uint32_t g : groups) light_[g][b] = ofGroup(here, g);
        for (Row& row : here) row = Row();  // {} would keep the memory
    }
    for (const uint32_t g : groups)
        if (store_) store_->keepSites(g, blocks_, light_[g], blocks);
}

Sparse<ProbeTermLight> SiteLight::take() {
    const std::vector<SiteRow> order = siteOrder(blocks_);
    auto all = Sparse<ProbeTermLight>::build(order.size(), [&](size_t begin, size_t end, auto emit) {
        std::vector<ProbeTermLight> row;
        for (size_t i = begin; i < end; ++i) {
            row.clear();
            for (uint32_t g = 0; g < paths_.groupCount(); ++g)
                for (const ProbeTermLight& l : light_[g][order[i].block].row(order[i].row))
                    row.push_back({paths_.termsOf(g)[l.term], l.light, l.variance, 0});
            std::ranges::sort(row, {}, &ProbeTermLight::term);
            emit(std::span<const ProbeTermLight>(row));
        }
    });
    light_.clear();
    return all;
}

std::vector<FitValue> statesOf(const Scene& scene, const Sparse<ProbeTermLight>& light, std::span<const Term> terms,
                               std::span<const SiteRow> order) {
    const std::vector<uint32_t> wholes = wholesOf(scene);
    const std::vector<float> weights = weightsOfGroups(wholes, light, terms, order);
    std::vector<FitValue> states(light.rows(), FitValue{});
    tbb::parallel_for(size_t{0}, light.rows(), [&](size_t i) {
        for (const ProbeTermLight& l : light.row(i)) {
            const Term& term = terms[l.term];
            const auto addTo = [&](size_t state) {
                for (size_t k = 0; k < 9; ++k)
                    states[i][9 * state + k] += weights[term.group] * luminance(l.light.radiance[k]);
            };
            if (term.doors_closed.empty()) addTo(0);
            if (term.doors_open.empty()) addTo(1 + wholes[term.group] % 2);
        }
    });
    return states;
}

}  // namespace dimmer::cook
