// Places where probes may stand, and the light there.
#pragma once

#include <bake/light_grid.h>
#include <bake/series.h>
#include <probes/fit.h>

#include <array>
#include <atomic>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// The states that placement looks at: every set on; always-on light with every other set; the other sets.
inline constexpr size_t site_states = 3;

struct SiteLight {
    FitValue states{};                  // luminance of the radiance, nine coefficients of each state
    std::vector<ProbeTermLight> terms;  // always-on light first, then what is active there
};

// Reads what the series left; thread-safe.
class Sites {
   public:
    Sites(const Gatherer& gatherer, const Series& series, const BakeSettings& settings);

    // At most `count` places in the open, half of them evenly over the level, half around its lamps (all evenly where
    // there is none), of at most 16 times as many tried; the share of the level's box that is open. The same places
    // come first whatever the count.
    std::vector<glm::vec3> choose(uint32_t count, double& free_share) const;
    // From as many rays as the noise needs to be small beside what interpolation misses.
    std::vector<SiteLight> trace(std::span<const glm::vec3> places, Progress& progress) const;
    // Adds the direct light at a probe and returns, of what arrives in each term, what decides on activity.
    void directAt(const GatherFrom& from, TermAccumulator<ProbeLight>& reflected,
                  TermAccumulator<ProbeLight>& stored) const;

    const Gatherer& gatherer() const { return gatherer_; }
    uint64_t raysTraced() const { return rays_traced_; }

   private:
    void take(TermAccumulator<ProbeLight>& sum, TermAccumulator<ProbeLight>& direct, SiteLight& out) const;

    glm::vec3 nearLamp(uint32_t index) const;

    const Gatherer& gatherer_;
    std::vector<glm::vec3> lamps_;
    const Series& series_;
    const BakeSettings& settings_;
    LightGrid lights_;
    mutable std::atomic<uint64_t> rays_traced_ = 0;
};

}  // namespace dimmer::cook
