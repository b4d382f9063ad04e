#include <bake/door_pairs.h>

#include <bake/sampling.h>
#include <bake/series.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace dimmer::cook {
namespace {

// The flux over a whole level is measured: so many rays in all, within limits per texel.
constexpr size_t measuring_rays = 200'000;
constexpr size_t texel_rays_min = 4, texel_rays_max = 16;
// Of the threshold, where a door by itself moves hardly any light.
constexpr double black_share = 0.1;
constexpr double all_but_gaps = 10;  // times what the lesser door moves by itself: leaves do not shut tight
// Of two fluxes only the ratio counts: what the last bounces bring goes to both.
constexpr float measured_tail_max = 0.05f;

// Between two doors' leaves, before they count as out of sight of each other; and how far from the leaves' surface
// towards the middle they start.
constexpr uint32_t sight_rays = 256;
constexpr float inwards = 0.1f;

BakeSettings few(BakeSettings settings, size_t texels) {
    const size_t rays = std::clamp(measuring_rays / texels, texel_rays_min, texel_rays_max);
    settings.series_rays = std::min(settings.series_rays, static_cast<uint32_t>(rays));
    settings.emitter_samples = 1;
    settings.tail_max = std::max(settings.tail_max, measured_tail_max);
    return settings;
}

// Whether a combination keeps the pair's light of a group.
bool covered(const Scene& scene, const DoorIndices& pair, uint32_t group) {
    return std::ranges::any_of(scene.combinations, [&](const std::vector<ElementRef>& combination) {
        const auto names = [&](uint32_t door) {
            return std::ranges::any_of(combination, [&](const ElementRef& e) { return e.is_door && e.index == door; });
        };
        const auto set = std::ranges::find(combination, false, &ElementRef::is_door);
        const bool of_group = set == combination.end() || groupOf(set->index) == group;
        return of_group && names(pair.first) && names(pair.second);
    });
}

bool coveredForAll(const Scene& scene, const DoorIndices& pair, uint32_t groups) {
    for (uint32_t g = 0; g < groups; ++g)
        if (!covered(scene, pair, g)) return false;
    return true;
}

// The doors that a term is about, ascending.
std::vector<uint32_t> doorsOf(const Term& term) {
    std::vector<uint32_t> doors;
    std::ranges::merge(term.doors_open, term.doors_closed, std::back_inserter(doors));
    return doors;
}

// Points within doors' leaves, where these stand closed and open.
class LeafPoints {
   public:
    explicit LeafPoints(const RayScene& rays) : rays_(rays), doors_(rays.scene().doors.size()) {
        std::vector<std::optional<glm::vec3>> centres(rays.scene().meshes.size());
        for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
            const LevelTriangle& triangle = rays.triangles()[t];
            if (triangle.condition == no_condition) continue;
            auto& centre = centres[triangle.mesh];
            if (!centre) centre = middleOf(rays.scene().meshes[triangle.mesh]);
            const glm::vec3 a = rays.corner(t, 0);
            Door& door = doors_[triangle.condition / 2];
            door.area_m2 += 0.5f * glm::length(glm::cross(rays.corner(t, 1) - a, rays.corner(t, 2) - a));
            door.leaves.push_back({t, *centre, door.area_m2});
        }
    }
    // The i-th of many, evenly over the leaves' surface and a little inwards: an edge may lie within a wall, or outside
    // of the level.
    std::optional<glm::vec3> point(uint32_t number, uint32_t i) const {
        const Door& door = doors_[number];
        const glm::vec3 u = sequence3d(i, number);
        const auto at = std::ranges::upper_bound(door.leaves, u.z * door.area_m2, {}, &Part::area_up_to_m2);
        if (at == door.leaves.end()) return std::nullopt;
        const glm::vec2 within = u.x + u.y > 1 ? glm::vec2(1 - u.x, 1 - u.y) : glm::vec2(u);
        return glm::mix(rays_.pointOn(at->triangle, within.x, within.y), at->centre, inwards);
    }

   private:
    struct Part {
        uint32_t triangle;
        glm::vec3 centre;     // of the leaf that it is of
        float area_up_to_m2;  // of the door's triangles until this one
    };
    struct Door {
        std::vector<Part> leaves;
        float area_m2 = 0;
    };
    static glm::vec3 middleOf(const SceneMesh& mesh) {
        glm::vec3 low = mesh.positions_m[0], high = low;
        for (const glm::vec3 p : mesh.positions_m) low = glm::min(low, p), high = glm::max(high, p);
        return 0.5f * (low + high);
    }

    const RayScene& rays_;
    std::vector<Door> doors_;
};

}  // namespace

std::vector<DoorIndices> doorsInSight(const RayScene& rays) {
    const LeafPoints leaves(rays);
    const auto doors = static_cast<uint32_t>(rays.scene().doors.size());
    const auto inSight = [&](uint32_t a, uint32_t b) {
        for (uint32_t i = 0; i < sight_rays; ++i) {
            // One sequence for both would join points at one distance from each other alone.
            const auto from = leaves.point(a, i), to = leaves.point(b, hash(i));
            if (!from || !to) return false;
            const glm::vec3 way = *to - *from;
            const float distance = glm::length(way);
            if (!(distance > 0) || rays.transmittance(*from, way / distance, distance, Surfaces::Walls) > 0)
                return true;
        }
        return false;
    };
    std::vector<std::vector<DoorIndices>> of_first(doors);
    tbb::parallel_for(uint32_t{0}, doors, [&](uint32_t a) {
        for (uint32_t b = a + 1; b < doors; ++b)
            if (inSight(a, b)) of_first[a].emplace_back(a, b);
    });
    std::vector<DoorIndices> pairs;
    for (const auto& some : of_first) pairs.insert(pairs.end(), some.begin(), some.end());
    return pairs;
}

std::vector<DoorIndices> doorsNear(const Links& links, const Sparse<uint32_t>& doors_seen) {
    if (doors_seen.entryCount() == 0) return {};
    std::vector<std::set<DoorIndices>> of_block(blockCount(doors_seen.rows()));
    forEachBlock(doors_seen.rows(), [&](size_t begin, size_t end) {
        std::set<DoorIndices>& pairs = of_block[begin / rows_per_block];
        std::vector<Link> seen;
        std::set<uint32_t> doors;
        for (size_t i = begin; i < end; ++i) {
            const auto own = doors_seen.row(i);
            doors = {own.begin(), own.end()};
            links.get(i, seen);
            for (const Link& link : seen) {
                if (link.path != free_path || !doors_seen.any(link.receiver)) continue;
                const auto theirs = doors_seen.row(link.receiver);
                doors.insert(theirs.begin(), theirs.end());
            }
            for (auto a = doors.begin(); a != doors.end(); ++a)
                for (auto b = std::next(a); b != doors.end(); ++b) pairs.emplace(*a, *b);
        }
    });
    std::set<DoorIndices> all;
    for (const auto& pairs : of_block) all.insert(pairs.begin(), pairs.end());
    return {all.begin(), all.end()};
}

std::vector<DoorFlux> doorFlux(const Gatherer& gatherer, const LightGrid& lights, const Series& series,
                               const BakeSettings& settings, std::span<const uint8_t> groups, Progress& progress,
                               RayEnds* links, uint32_t terms_at_once) {
    const Scene& scene = gatherer.rays().scene();
    std::vector<DoorIndices> pairs = series.doors_near;
    std::erase_if(pairs, [&](const DoorIndices& p) { return coveredForAll(scene, p, gatherer.paths().groupCount()); });
    std::vector<DoorFlux> flux(groups.size());
    if (pairs.empty()) return flux;
    const auto in_sight = doorsInSight(gatherer.rays());
    for (DoorFlux& f : flux) {
        f.alone.resize(scene.doors.size());
        for (const DoorIndices& pair : pairs) f.pairs.push_back({pair.first, pair.second});
    }
    // As many pairs together as there are numbers for their terms.
    const size_t own = gatherer.paths().termCount(), of_pair = pairTerms(gatherer.paths().groupCount());
    const size_t at_once = std::max<size_t>(1, (std::max<size_t>(terms_at_once, own) - own) / of_pair);
    for (size_t first = 0; first < pairs.size(); first += at_once) {
        const auto some = std::span(pairs).subspan(first, std::min(at_once, pairs.size() - first));
        Scene named = scene;
        for (const DoorIndices& pair : some) named.combinations.push_back({{true, pair.first}, {true, pair.second}});
        const DoorPaths paths(named, in_sight);
        const Gatherer keeping_pairs(gatherer, paths);
        const std::vector<double> measured =
            termFlux(keeping_pairs, lights, few(settings, gatherer.texels().size()), progress, groups, links);
        for (uint32_t t = 0; t < paths.termCount(); ++t) {
            const Term& term = paths.terms()[t];
            const auto doors = doorsOf(term);
            const double energy = measured[t];
            DoorFlux& f = flux[term.group];
            for (const uint32_t door : doors)
                if (first == 0 && (term.doors_open.empty() || term.doors_open == std::vector{door}))
                    f.alone[door] += energy;
            if (doors.size() != 2 || term.doors_open.empty()) continue;
            const auto pair = std::ranges::lower_bound(some, DoorIndices(doors[0], doors[1]));  // they ascend
            if (pair != some.end() && *pair == DoorIndices(doors[0], doors[1]) && !covered(scene, *pair, term.group))
                f.pairs[first + static_cast<size_t>(pair - some.begin())].flux += energy;
        }
    }
    return flux;
}

std::vector<DoorPair> dependentDoors(std::span<const DoorFlux> flux, const BakeSettings& settings) {
    const auto sum = [&](auto&& of_group) {
        double all = 0;
        for (size_t g = 0; g < flux.size(); ++g)
            all += (settings.group_brightness.empty() ? 1.0 : static_cast<double>(settings.group_brightness[g])) *
                   of_group(flux[g]);
        return all;
    };
    std::vector<DoorPair> found;
    for (size_t p = 0; !flux.empty() && p < flux[0].pairs.size(); ++p) {
        const uint32_t first = flux[0].pairs[p].first, second = flux[0].pairs[p].second;
        const auto alone = [&](uint32_t door) { return sum([&](const DoorFlux& f) { return f.alone[door]; }); };
        const auto [less, more] = std::minmax({alone(first), alone(second)});
        const double off = sum([&](const DoorFlux& f) { return f.pairs[p].flux; });
        // Behind one door in a row with another there may be no light but through both, what comes past its edges
        // aside: a room that is black instead of dim shows, however little of the first one's light gets there.
        const bool all = off > all_but_gaps * less;
        const bool shows = off > black_share * static_cast<double>(settings.threshold) * more;
        if (!(off > 0) || (all && !shows)) continue;
        const float loss = all ? INFINITY : static_cast<float>(off / less);
        if (loss > settings.threshold) found.push_back({first, second, loss});
    }
    std::ranges::stable_sort(found, std::greater{}, &DoorPair::loss);
    return found;
}

}  // namespace dimmer::cook
