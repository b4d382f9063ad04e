// The light of one probe: which terms are active there, and their radiance.
#pragma once

#include <bake/final_gather.h>
#include <bake/light_grid.h>
#include <bake/series.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// One worker's scratch; not thread-safe, make one per thread.
template <class Light>
class ReceiverGather {
   public:
    // `groups`: per light group, whether it is asked for; `lights` has the lamps of those.
    ReceiverGather(const Gatherer& gatherer, const LightGrid& lights, const Series& series,
                   const BakeSettings& settings, std::span<const uint8_t> groups);

    // Replaces `row`. Returns the rays traced.
    uint64_t gather(const GatherFrom& from, std::vector<LightOfTerm<Light>>& row);

   private:
    // Returns the shadow rays traced.
    uint64_t findActive(const GatherFrom& from);

    const Gatherer& gatherer_;
    const LightGrid& lights_;
    const Series& series_;
    const BakeSettings& settings_;
    std::span<const uint8_t> groups_;
    std::vector<uint32_t> wanted_in_group_;
    std::vector<float> floors_;
    FinalGatherOptions options_;
    FinalGather<Light> final_;
    TermAccumulator<Light> sum_, direct_, stored_;
    std::vector<float> free_lux_;             // per light group, of what comes with all doors closed
    std::vector<uint32_t> active_, bounced_;  // terms; of the latter, light came from surfaces
};

}  // namespace dimmer::cook
