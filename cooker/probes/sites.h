// The light at places where probes may stand, block by block and group by group, as a cache keeps it.
#pragma once

#include <bake/light_grid.h>
#include <bake/series.h>
#include <probes/fit.h>
#include <probes/site_choice.h>

#include <array>
#include <atomic>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// What is known of the light at the places, per group and block; the rest is to be traced.
class SiteLight {
   public:
    // Takes from `store` (null: nothing) what it has.
    SiteLight(std::span<const SiteBlock> blocks, const DoorPaths& paths, GroupStore* store);

    // Per group: whether something of its light is to be traced.
    std::vector<uint8_t> asked() const;
    // Traces that; `lights`, `radiance` and `reports` have what the asked groups need. Keeps it in the store. From as
    // many rays as the noise needs to be small beside what interpolation misses. Returns the rays traced.
    uint64_t trace(const Gatherer& gatherer, const LightGrid& lights, const SparseLight& radiance,
                   std::span<const TermReport> reports, const BakeSettings& settings, Progress& progress);
    // Per place in siteOrder(), ascending, what is active there. Empties this.
    Sparse<ProbeTermLight> take();

   private:
    using Row = std::vector<ProbeTermLight>;
    std::vector<uint32_t> missingAt(size_t block) const;
    void share(std::span<Row> rows, std::span<const size_t> blocks, std::span<const uint32_t> groups);
    Sparse<ProbeTermLight> ofGroup(std::span<const Row> rows, uint32_t group) const;
    uint32_t groupOf(const ProbeTermLight& light) const { return paths_.terms()[light.term].group; }
    bool isMissing(uint32_t group, size_t block) const { return light_[group][block].rows() == 0; }

    std::span<const SiteBlock> blocks_;
    const DoorPaths& paths_;
    GroupStore* store_;
    std::vector<std::vector<Sparse<ProbeTermLight>>> light_;  // per group, per block; no rows: missing
};

// What placement looks at: all light together, with all doors open; then each half of the light sets (always-on light
// with one), so that light which leaks from a set's room into a dark one is seen, with doors closed. Luminance of the
// radiance, nine coefficients of each state. Every group counts by its own mean over those of the first block's places
// (all over the level) that it reaches: where probes stand does not depend on how bright a set is. `order`: of the
// light's rows.
inline constexpr size_t site_states = 3;
std::vector<FitValue> statesOf(const Scene& scene, const Sparse<ProbeTermLight>& light, std::span<const Term> terms,
                               std::span<const SiteRow> order);

}  // namespace dimmer::cook
