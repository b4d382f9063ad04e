#include <pipeline/door_warnings.h>

#include <scene/combinations.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

namespace dimmer::cook {
namespace {

// Pairs told one by one; a corridor of 24 doors has 137, and other warnings are to be seen.
constexpr size_t pairs_told = 8;
constexpr size_t chains_told = 3;  // for one door that nothing lights
constexpr const char* mend = "in the scene's 'dimmer_combinations' (--suggest-combinations prints the list)";

using Doors = std::set<uint32_t>;

class ElementWarnings {
   public:
    ElementWarnings(const Scene& scene, const Baked& baked, CookStats& stats)
        : scene_(scene), baked_(baked), stats_(stats), does_(scene.doors.size()) {
        for (uint32_t t = 0; t < baked.terms.size(); ++t)
            for (const auto* doors : {&baked.terms[t].doors_open, &baked.terms[t].doors_closed})
                for (const uint32_t door : *doors)
                    does_[door] = std::max(does_[door], baked.reports[t].receivers > 0 ? Does::Change
                                                        : baked.reports[t].energy > 0  ? Does::Little
                                                                                       : Does::Nothing);
        // What is lit through two doors alone is told with the pair.
        for (const DoorPair& pair : baked.dependent_doors) does_[pair.first] = does_[pair.second] = Does::Change;
    }

    void ofSets() {
        for (uint32_t t = 0; t < baked_.terms.size(); ++t) {
            const Term& term = baked_.terms[t];
            if (baked_.reports[t].receivers > 0 || !term.free() || term.group == always_group) continue;
            const auto shines = [&](const PunctualLight& light) {
                return light.light_set == term.group - 1 && light.intensity != glm::vec3(0);
            };
            const bool dark =
                std::ranges::none_of(scene_.lights, shines) &&
                std::ranges::none_of(scene_.meshes, [&](const SceneMesh& m) { return m.light_set == term.group - 1; });
            add(fmt::format("light set '{}' {}", scene_.light_sets[term.group - 1].name,
                            baked_.reports[t].energy > 0 ? below
                            : dark ? "has lights of intensity 0 alone; it is kept, and does nothing"
                                   : "reaches no surface; it is kept, and does nothing"));
        }
    }

    void ofIdleDoors() {
        for (uint32_t door = 0; door < does_.size(); ++door) {
            if (does_[door] == Does::Change) continue;
            const std::vector<Doors> chains = chainsTo(door);
            if (chains.empty()) {
                const char* what =
                    does_[door] == Does::Little ? below : "changes no light; it is kept, and does nothing";
                add(fmt::format("door '{}' {}", scene_.doors[door].name, what));
                continue;
            }
            std::string names;
            for (const Doors& chain : chains) {
                stats_.suggested_combinations.push_back(namesOf(chain));
                names += fmt::format("{}{}", names.empty() ? "" : " or ", listOf(chain));
            }
            add(
                fmt::format("door '{}' changes no light by itself: if light comes to it through other doors alone, "
                            "name {} {}; if none does, it does nothing",
                            scene_.doors[door].name, names, mend));
        }
    }

    void ofPairs() {
        const std::vector<DoorPair>& pairs = baked_.dependent_doors;  // the largest loss first
        for (size_t i = 0; i < pairs.size(); ++i) {
            const Doors pair = {pairs[i].first, pairs[i].second};
            stats_.suggested_combinations.push_back(namesOf(pair));
            if (i >= pairs_told) continue;
            const std::string what =
                std::isinf(pairs[i].loss)
                    ? "light that only comes through both is missing while both are open"
                    : fmt::format("some {:.0f} % of the light that the lesser of them moves is off while both are open",
                                  100 * static_cast<double>(pairs[i].loss));
            add(fmt::format("'{}' and '{}' depend on each other: {}; name {} {}", namesOf(pair)[0], namesOf(pair)[1],
                            what, listOf(pair), mend));
        }
        if (pairs.size() <= pairs_told) return;
        const float loss = pairs[pairs_told].loss;
        const std::string most =
            std::isinf(loss) ? "" : fmt::format(", for {:.0f} % at most", 100 * static_cast<double>(loss));
        add(fmt::format("{} pairs of doors more depend on each other{}: --suggest-combinations prints the list",
                        pairs.size() - pairs_told, most));
    }

   private:
    enum class Does { Nothing, Little, Change };

    static constexpr const char* below =
        "changes light by less than its activity threshold everywhere; it is kept, and does nothing. Lower "
        "'records.threshold'";

    void add(const std::string& what) { stats_.warnings.push_back(fmt::format("{}: {}", scene_.file, what)); }

    std::vector<std::string> namesOf(const Doors& doors) const {
        std::vector<std::string> names;
        for (const uint32_t door : doors) names.push_back("door:" + scene_.doors[door].name);
        return names;
    }
    std::string listOf(const Doors& doors) const {
        return fmt::format("[\"{}\"]", fmt::join(namesOf(doors), "\", \""));
    }

    std::vector<Doors> named() const {
        std::vector<Doors> all;
        for (const auto& combination : scene_.combinations) {
            Doors doors;
            for (const ElementRef& e : combination)
                if (e.is_door) doors.insert(e.index);
            if (doors.size() > 1) all.push_back(std::move(doors));
        }
        return all;
    }

    bool areNear(uint32_t a, uint32_t b, const std::vector<Doors>& named) const {
        const auto both = [&](const Doors& doors) { return doors.contains(a) && doors.contains(b); };
        return std::ranges::any_of(named, both) || std::ranges::any_of(baked_.door_flux, [&](const DoorFlux& flux) {
                   return std::ranges::any_of(flux.pairs, [&](const DoorFlux::Pair& p) {
                       return both({p.first, p.second});
                   });
               });
    }

    // Doors that light passes together, as the level says or the bake found, with a door near one of them that nothing
    // reaches: what three doors let pass in a row is in no pair's light. Not those that the level names.
    std::vector<Doors> chainsTo(uint32_t door) const {
        const std::vector<Doors> is_named = named();
        std::vector<Doors> before = is_named, chains;
        for (const DoorPair& pair : baked_.dependent_doors) before.push_back({pair.first, pair.second});
        for (const Doors& doors : before) {
            if (doors.contains(door) ||
                std::ranges::any_of(doors, [&](uint32_t d) { return does_[d] != Does::Change; }))
                continue;
            if (std::ranges::none_of(doors, [&](uint32_t d) { return areNear(d, door, is_named); })) continue;
            Doors chain = doors;
            chain.insert(door);
            const auto holds = [&](const Doors& other) { return std::ranges::includes(other, chain); };
            if (chain.size() > combined_doors_max || std::ranges::any_of(is_named, holds)) continue;
            if (std::ranges::find(chains, chain) == chains.end()) chains.push_back(std::move(chain));
            if (chains.size() == chains_told) break;
        }
        return chains;
    }

    const Scene& scene_;
    const Baked& baked_;
    CookStats& stats_;
    std::vector<Does> does_;  // per door, by itself or with one that depends on it
};

}  // namespace

void warnOfElements(const Scene& scene, const Baked& baked, CookStats& stats) {
    ElementWarnings warnings(scene, baked, stats);
    warnings.ofSets();
    warnings.ofIdleDoors();
    warnings.ofPairs();
}

}  // namespace dimmer::cook
