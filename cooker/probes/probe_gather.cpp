#include <probes/probe_gather.h>

#include <bake/direct.h>
#include <bake/sampling.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

// Rays go all around, and there are few probes: more of them than a texel gets.
constexpr uint32_t rays_per_texel_ray = 4;

}  // namespace

template <class Light>
ReceiverGather<Light>::ReceiverGather(const Gatherer& gatherer, const LightGrid& lights, const Series& series,
                                      const BakeSettings& settings, std::span<const uint8_t> groups)
    : gatherer_(gatherer),
      lights_(lights),
      series_(series),
      settings_(settings),
      groups_(groups),
      wanted_in_group_(groups.size()),
      floors_(noiseFloors(series, gatherer.paths().groupCount())),
      options_(finalGatherOptions(settings, floors_)),
      final_(gatherer_),
      sum_(gatherer_.paths().termCount()),
      direct_(gatherer_.paths().termCount()),
      stored_(gatherer_.paths().termCount()),
      free_lux_(groups.size()) {
    if (std::is_same_v<Light, ProbeLight>) options_.rays_max *= rays_per_texel_ray;
    for (uint32_t t = 0; t < gatherer_.paths().termCount(); ++t) {
        const uint32_t group = gatherer_.paths().terms()[t].group;
        sum_.setWanted(t, groups_[group] != 0);
        wanted_in_group_[group] += groups_[group] != 0;
    }
}

template <class Light>
uint64_t ReceiverGather<Light>::gather(const GatherFrom& from, std::vector<LightOfTerm<Light>>& row) {
    const uint64_t shadow_rays = findActive(from);
    row.clear();
    const uint64_t traced = final_.gather(from, active_, series_.radiance, options_, row, nullptr, bounced_);
    for (LightOfTerm<Light>& l : row)
        if (const auto touched = stored_.touched(); std::ranges::binary_search(touched, l.term))
            l.light += stored_[l.term];
    stored_.clear();
    return shadow_rays + traced + settings_.series_rays;
}

// Lit straight, or by as much as the term's threshold asks: by own rays, where texels look at their neighbours' too.
template <class Light>
uint64_t ReceiverGather<Light>::findActive(const GatherFrom& from) {
    const uint64_t shadow_rays = directLight(gatherer_, lights_, from, direct_, stored_);
    gatherer_.gather(from,
                     {.rays = settings_.series_rays,
                      .emitter_samples = settings_.emitter_samples,
                      .seed = settings_.seed,
                      .wanted_in_group = wanted_in_group_},
                     &series_.radiance, sum_, nullptr);
    bounced_.clear();
    for (const uint32_t t : sum_.touched())
        if (luminance(sum_[t].irradiance()) > 0) bounced_.push_back(t);
    std::ranges::sort(bounced_);
    active_.assign(1, always_group);
    std::ranges::fill(free_lux_, 0.0f);
    for (auto* light : {&direct_, &sum_})
        for (const uint32_t t : light->touched())
            if (t < free_lux_.size()) free_lux_[t] += luminance((*light)[t].irradiance());
    for (auto* light : {&direct_, &sum_}) {
        for (const uint32_t t : light->touched()) {
            const float lux = luminance((*light)[t].irradiance());
            if (t != always_group && series_.active(t, 0, lux, free_lux_[series_.group_of[t]])) active_.push_back(t);
        }
        light->clear();
    }
    std::ranges::sort(active_);
    active_.erase(std::unique(active_.begin(), active_.end()), active_.end());
    std::erase_if(active_, [&](uint32_t t) { return !groups_[gatherer_.paths().terms()[t].group]; });
    return shadow_rays;
}

template class ReceiverGather<Gathered>;
template class ReceiverGather<ProbeLight>;

}  // namespace dimmer::cook
