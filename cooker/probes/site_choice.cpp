#include <probes/site_choice.h>

#include <bake/sampling.h>
#include <probes/free_space.h>
#include <probes/tetrahedra.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dimmer::cook {
namespace {

// On average over the free space: the grid need not be denser to be as right as lightmaps are, but where it is small:
// there, light of a lamp falls off over less than a metre everywhere.
constexpr double density_max_per_m3 = 1, small_density_max_per_m3 = 4, small_probes = 32, small_probes_max = 256;
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
// Of the others, so many lie at surfaces, edges and corners: where things stand, and where a tetrahedron whose probes
// are all behind a wall or a floor is found by nothing else (that strip is a thousandth of a room).
constexpr double share_at_surfaces = 0.2;
constexpr float off_surface_min_m = 0.055f, off_surface_max_m = 0.085f;  // beyond probe_clearance_m
// And so many on both sides of doors' leaves, as far as that: no probe looks through a leaf that may close, so those on
// either side tell of its open doorway by themselves, where light changes over less than a metre.
constexpr double share_at_doors = 0.2;
constexpr uint32_t places_per_door_max = 400;
constexpr float off_leaf_max_m = 0.5f;
constexpr glm::vec3 nowhere(std::numeric_limits<float>::quiet_NaN());  // in no box
constexpr float lamp_reach_min_m = 0.8f;
// Light changes over lengths like the distance to surfaces (Ward and Heckbert 1992), and what asks for it moves near
// them: places farther off than this many times the mean spacing of probes become rarer.
constexpr double near_spacings = 0.8;
constexpr uint32_t rarity_seed = 0x2c1b3c6du, surface_seed = 0x1f123bb5u, lamp_place_seed = 0x51ed270bu,
                   door_place_seed = 0x7a1c9e35u;
// Small levels get up to four times the rays from each place, while all of them are no more than so many places' usual
// ones: noise misleads where to put the few probes they have.
constexpr uint32_t small_level_places = 15625, small_level_factor = 4;

class Chooser {
   public:
    Chooser(const RayScene& rays, const GridSettings& settings, GroupStore* store)
        : rays_(rays), settings_(settings), store_(store) {
        out_.air = airBox(rays);
        for (const PunctualLight& light : rays.scene().lights)
            if (light.type != LightType::Directional && light.bake != BakeMode::None &&
                std::ranges::find(lamps_, light.position_m) == lamps_.end())
                lamps_.push_back(light.position_m);
        leaves_.resize(rays.scene().doors.size());
        for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
            const uint32_t condition = rays.triangles()[t].condition;
            if (condition == no_condition || condition % 2 != 0) continue;
            const glm::vec3 a = rays.corner(t, 0);
            const glm::vec3 cross = glm::cross(rays.corner(t, 1) - a, rays.corner(t, 2) - a);
            Leaf& leaf = leaves_[condition / 2];
            leaf.triangles.push_back(t);
            leaf.cumulative_m2.push_back((leaf.cumulative_m2.empty() ? 0 : leaf.cumulative_m2.back()) +
                                         0.5f * glm::length(cross));
        }
        std::erase_if(leaves_, [](const Leaf& leaf) { return leaf.triangles.empty(); });
    }

    Expected<SiteChoice> run() {
        const uint32_t wanted = decideCounts();
        const uint32_t affordable = std::clamp(small_level_places * settings_.site_rays / std::max(wanted, 1u),
                                               settings_.site_rays, small_level_factor * settings_.site_rays);
        const uint32_t rays = (affordable + 1) / 2 * 2;  // in two halves
        const auto at_lamps = lamps_.empty() ? 0 : static_cast<uint32_t>(share_near_lamps * wanted);
        const auto at_surfaces = settings_.uniform ? 0 : static_cast<uint32_t>(share_at_surfaces * (wanted - at_lamps));
        const uint32_t at_doors = settings_.uniform
                                      ? 0
                                      : std::min(static_cast<uint32_t>(share_at_doors * (wanted - at_lamps)),
                                                 static_cast<uint32_t>(leaves_.size()) * places_per_door_max);
        out_.blocks.push_back({allOver(wanted - at_lamps - at_surfaces - at_doors), rays});
        out_.blocks.push_back({atSurfaces(at_surfaces), rays});
        if (at_doors > 0) out_.blocks.push_back({atDoors(at_doors), rays});
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
        const double probes =
            std::floor(std::min(std::max(probesByVolume() - 8, 8.0), static_cast<double>(settings_.probes_max)));
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

    double probesByVolume() const {
        const double m3 = out_.free_volume_m3;
        if (settings_.probes_per_m3 > 0) return static_cast<double>(settings_.probes_per_m3) * m3;
        return std::max(density_max_per_m3 * m3,
                        std::min(small_probes + small_density_max_per_m3 * m3, small_probes_max));
    }

    glm::vec3 anywhere(uint32_t i) const {
        const glm::vec3 low = out_.air.min_m, size = out_.air.max_m - low;
        return low + size * glm::vec3(radicalInverse(2, i + 1), radicalInverse(3, i + 1), radicalInverse(5, i + 1));
    }
    // Uniform in the distance, so that each shell around a lamp gets as many (but for what is far from surfaces): light
    // there falls with its square.
    glm::vec3 nearLamp(glm::vec3 lamp_m, uint32_t i) const {
        const glm::vec3 u = sequence3d(i, lamp_place_seed);
        return lamp_m + lamp_reach_m_ * u.z * uniformSphereDirection({u.x, u.y});
    }

    std::vector<glm::vec3> allOver(uint32_t count) const {
        return sites({static_cast<float>(count), near_m_}, count, [&](uint32_t i) { return anywhere(i); });
    }
    // A third at a surface, a third along an edge, a third in a corner of three surfaces.
    std::vector<glm::vec3> atSurfaces(uint32_t count) const {
        return sites({static_cast<float>(count), near_m_, off_surface_max_m}, count,
                     [&](uint32_t i) { return atSurface(i); });
    }
    // From a place on in some direction to a surface, along that to the next, along both to a third.
    glm::vec3 atSurface(uint32_t i) const {
        const uint32_t seed = hash(i, surface_seed);
        // By chance: the place's height follows from the last digits of its number.
        const uint32_t surfaces = 1 + hash(seed, 8) % 3;
        const float off_m = off_surface_min_m + (off_surface_max_m - off_surface_min_m) * unitFloat(hash(seed, 0));
        glm::vec3 p = anywhere(i), direction = uniformSphereDirection(sequence2d(i, surface_seed)), before(0);
        for (uint32_t s = 0; s < surfaces; ++s) {
            const auto hit = rays_.nearest(p, direction, far_away_m, hash(seed, 1 + s));
            const LevelTriangle* met = hit ? &rays_.triangles()[hit->triangle] : nullptr;
            const bool solid_back = met && hit->back && !rays_.scene().materials[met->material].double_sided;
            if (!met || solid_back) return s == 0 ? nowhere : p;
            const glm::vec3 normal = hit->back ? -met->normal : met->normal;
            const float back_m = off_m / std::max(-glm::dot(normal, direction), 1e-3f);
            p += std::max(hit->distance_m - back_m, 0.0f) * direction;
            const glm::vec3 along =
                s == 0 ? direction - glm::dot(direction, normal) * normal : glm::cross(before, normal);
            if (!(glm::dot(along, along) > 1e-6f)) return p;
            direction = glm::normalize(along) * (s > 0 && hash(seed, 7) % 2 ? -1.0f : 1.0f);
            before = normal;
        }
        return p;
    }
    std::vector<glm::vec3> atDoors(uint32_t count) const {
        return sites({static_cast<float>(count), near_m_, off_surface_min_m, off_leaf_max_m}, count,
                     [&](uint32_t i) { return atDoor(i); });
    }
    // The doors in turns; off any of a leaf's triangles, by its area, to either side.
    glm::vec3 atDoor(uint32_t i) const {
        const auto& [triangles, areas] = leaves_[i % leaves_.size()];
        const uint32_t seed = hash(i, door_place_seed);
        const auto above = std::ranges::upper_bound(areas, areas.back() * unitFloat(hash(seed, 0)));
        const uint32_t t = triangles[std::min(static_cast<size_t>(above - areas.begin()), triangles.size() - 1)];
        const glm::vec2 on = uniformOnTriangle(sequence2d(i, door_place_seed));
        const float side = hash(seed, 1) % 2 == 0 ? 1.0f : -1.0f;
        const float off_m = glm::mix(off_surface_min_m, off_leaf_max_m, unitFloat(hash(seed, 2)));
        return rays_.pointOn(t, on.x, on.y) + side * off_m * rays_.triangles()[t].normal;
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
        std::vector<glm::vec3> all(count), places;
        tbb::parallel_for(0u, count, [&](uint32_t i) {
            all[i] = at(begin + i);
            is_wanted[i] = wanted(all[i], begin + i);
        });
        for (uint32_t i = 0; i < count; ++i)
            if (is_wanted[i]) places.push_back(all[i]);
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
    struct Leaf {
        std::vector<uint32_t> triangles;
        std::vector<float> cumulative_m2;
    };
    std::vector<Leaf> leaves_;  // closed ones, of the doors that have any
    float lamp_reach_m_ = 0, near_m_ = 0;
    SiteChoice out_;
};

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

}  // namespace dimmer::cook
