#include <probes/sites.h>

#include <bake/direct.h>
#include <bake/final_gather.h>
#include <bake/sampling.h>
#include <probes/free_space.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

constexpr uint32_t tries_per_site = 16;
// One place in so many is tried near a lamp, where light changes over a hand's breadth.
constexpr uint32_t lamp_period = 2;
constexpr float lamp_reach_m = 0.8f;
// Rays are uniform over the sphere: 256 leave some 5 % of noise in irradiance, and a probe's light is fitted to several
// sites. Small levels get more, as noise misleads where to put the few probes they have.
constexpr size_t site_rays_min = 256, site_rays_max = 1024, small_level_rays = 4'000'000;
constexpr size_t sites_per_task = 64;
constexpr uint32_t site_seed = 0x51ed270bu;

// Doors are closed. Neighbouring light sets fall on both sides of a wall as well as not, so that light which leaks
// through it is seen as an error in one of the halves.
bool counts(const Term& term, size_t state) {
    return term.doors_open.empty() && (state == 0 || term.group % 2 == state - 1);
}

}  // namespace

Sites::Sites(const Gatherer& gatherer, const Series& series, const BakeSettings& settings)
    : gatherer_(gatherer), series_(series), settings_(settings), lights_(gatherer.rays(), settings.light_grid) {
    for (const PunctualLight& light : gatherer.rays().scene().lights)
        if (light.type != LightType::Directional && light.bake != BakeMode::None) lamps_.push_back(light.position_m);
}

// Uniform in the distance, so that each shell around a lamp gets as many: light there falls with its square.
glm::vec3 Sites::nearLamp(uint32_t index) const {
    const glm::vec3 u = sequence3d(index, site_seed);
    return lamps_[index % lamps_.size()] + lamp_reach_m * u.z * uniformSphereDirection({u.x, u.y});
}

std::vector<glm::vec3> Sites::choose(uint32_t count, double& free_share) const {
    const glm::vec3 low = gatherer_.rays().boundsMin(), size = gatherer_.rays().boundsMax() - low;
    std::vector<glm::vec3> sites;
    uint32_t tried = 0, found = 0, anywhere = 0;
    constexpr uint32_t block = 4096;
    std::vector<uint8_t> is_free(block);
    const auto isNearLamp = [&](uint32_t i) { return !lamps_.empty() && (tried + i) % lamp_period == 0; };
    while (sites.size() < count && tried < tries_per_site * count) {
        const auto at = [&](uint32_t i) {
            // Each kind numbers its own tries: every third point of a Halton sequence would leave gaps.
            const uint32_t lamp_index = (tried + i) / lamp_period;
            if (isNearLamp(i)) return nearLamp(lamp_index);
            const uint32_t index = lamps_.empty() ? tried + i + 1 : tried + i - lamp_index;
            return low + size * glm::vec3(radicalInverse(2, index), radicalInverse(3, index), radicalInverse(5, index));
        };
        tbb::parallel_for(0u, block, [&](uint32_t i) { is_free[i] = inTheOpen(gatherer_.rays(), at(i)); });
        for (uint32_t i = 0; i < block; ++i) {
            found += is_free[i] && !isNearLamp(i);
            anywhere += !isNearLamp(i);
            if (is_free[i] && sites.size() < count) sites.push_back(at(i));
        }
        tried += block;
    }
    free_share = static_cast<double>(found) / std::max(anywhere, 1u);
    return sites;
}

void Sites::directAt(const GatherFrom& from, TermAccumulator<ProbeLight>& reflected,
                     TermAccumulator<ProbeLight>& stored) const {
    rays_traced_ += directLight(gatherer_, lights_, from, reflected, stored);
}

std::vector<SiteLight> Sites::trace(std::span<const glm::vec3> places, Progress& progress) const {
    progress.stage("light at probe sites", places.size());
    std::vector<SiteLight> out(places.size());
    const auto rays = static_cast<uint32_t>(
        std::clamp(small_level_rays / std::max<size_t>(places.size(), 1), site_rays_min, site_rays_max));
    tbb::parallel_for(tbb::blocked_range<size_t>(0, places.size(), sites_per_task), [&](const auto& range) {
        TermAccumulator<ProbeLight> sum(gatherer_.paths().termCount()), direct(gatherer_.paths().termCount());
        for (size_t i = range.begin(); i < range.end(); ++i) {
            const SamplePoint point{places[i], no_face};
            const GatherFrom from = Gatherer::atProbe(point, site_seed + static_cast<uint32_t>(i));
            directAt(from, direct, sum);
            gatherer_.gather(from,
                             {.rays = rays,
                              .emitter_samples = settings_.emitter_samples * rays / rays_per_round,
                              .seed = settings_.seed + 2,
                              .wanted_in_group = {}},
                             &series_.radiance, sum, nullptr);
            take(sum, direct, out[i]);
            sum.clear();
            direct.clear();
        }
        rays_traced_ += range.size() * rays;
        progress.advance(range.size());
    });
    return out;
}

void Sites::take(TermAccumulator<ProbeLight>& sum, TermAccumulator<ProbeLight>& direct, SiteLight& out) const {
    sum[always_group];  // every site has some
    for (const uint32_t t : direct.touched()) sum[t];
    for (const uint32_t t : sum.touched()) {
        const ProbeLight& light = sum[t];
        const Term& term = gatherer_.paths().terms()[t];
        const float brightness = settings_.group_brightness.empty() ? 1 : settings_.group_brightness[term.group];
        for (size_t state = 0; state < site_states; ++state)
            if (counts(term, state))
                for (size_t k = 0; k < 9; ++k) out.states[9 * state + k] += brightness * luminance(light.radiance[k]);
        if (series_.active(t, luminance(direct[t].irradiance()), luminance(light.irradiance())))
            out.terms.push_back({t, light, 0});
    }
}

}  // namespace dimmer::cook
