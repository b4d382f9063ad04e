#include <probes/sites.h>

#include <bake/direct.h>
#include <bake/final_gather.h>
#include <bake/sampling.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string_view>

namespace dimmer::cook {
namespace {

constexpr size_t sites_per_task = 64;
constexpr uint32_t site_seed = 0x51ed270bu;
// Of a light set, beside always-on light: sets are off at times.
constexpr float weight_of_sets = 0.05f;

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
          free_lux_(gatherer.paths().groupCount()),
          wanted_in_group_(gatherer.paths().groupCount()) {
        for (uint32_t t = 0; t < gatherer.paths().termCount(); ++t) {
            const uint32_t group = gatherer.paths().terms()[t].group;
            sum_.setWanted(t, groups[group] != 0);
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
        // Halves of one sequence fill each other's gaps: of light that one finds the other finds less. Of two sequences
        // they would be independent, and noise larger (decisions.md).
        for (const uint32_t first_ray : {0u, rays / 2}) {
            gatherer_.gather(
                from,
                {.rays = rays / 2,
                 .emitter_samples = (settings_.emitter_samples * (rays / 2) + rays_per_round - 1) / rays_per_round,
                 .seed = settings_.seed + 2,
                 .first_ray = first_ray,
                 .wanted_in_group = wanted_in_group_,
                 .row = ends},
                &radiance_, sum_, nullptr);
            if (first_ray > 0) continue;
            for (const uint32_t t : sum_.touched()) first_half_lux_[t] = luminance(sum_[t].irradiance());
        }
        if (sum_.wants(always_group)) sum_[always_group];  // every site has some
        for (const uint32_t t : direct_.touched())
            if (sum_.wants(t)) sum_[t];
        row.reserve(sum_.touched().size());
        std::ranges::fill(free_lux_, 0.0f);  // the first terms, of those that ascend
        for (const uint32_t t : sum_.touched()) {
            if (!sum_.wants(t)) continue;
            ProbeLight light = sum_[t] * 0.5f;  // of two halves
            const float off = first_half_lux_[t] - luminance(light.irradiance());
            first_half_lux_[t] = 0;
            light += full_[t];
            const float lux = luminance(light.irradiance());
            const float direct_lux = luminance(direct_[t].irradiance());
            if (t < free_lux_.size()) free_lux_[t] = lux + direct_lux;
            if (isActive(reports_[t], t, direct_lux, lux, free_lux_[gatherer_.paths().group(t)]))
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
    std::vector<float> first_half_lux_;                // per term, of what rays found; 0 between places
    std::vector<float> free_lux_;                      // per light group, with all doors closed
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

uint64_t SiteLight::trace(const Gatherer& gatherer, const LightGrid& level_lights, const SparseLight& radiance,
                          std::span<const TermReport> reports, const BakeSettings& settings, Progress& progress) {
    const auto asked_groups = asked();
    if (std::ranges::count(asked_groups, 1) == 0) return 0;
    const LightGrid lights = level_lights.ofGroups(asked_groups);
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
