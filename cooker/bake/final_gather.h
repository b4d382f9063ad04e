// The last gather: many rays per receiver, as many for each light group as its own noise asks for.
#pragma once

#include <bake/bake.h>
#include <bake/series.h>

#include <span>

namespace dimmer::cook {

struct FinalGatherOptions {
    uint32_t rays_max = 128;
    uint32_t emitter_samples = 8;  // per round of rays
    float noise_max = 0;           // 95 % interval, relative to irradiance + floor; 0: always rays_max
    uint32_t seed = 0;
    std::span<const float> floor_lux;  // per group: light below this need not be exact to a share of itself
};

// Per group, the light that need not be exact to a share of itself.
std::vector<float> noiseFloors(const Series& series);
FinalGatherOptions finalGatherOptions(const BakeSettings& settings, std::span<const float> floors_lux);

// Rays come in rounds of this many; the spread of the rounds' means is the noise.
inline constexpr uint32_t rays_per_round = 32;

// One worker's scratch; not thread-safe, make one per thread.
class FinalGather {
   public:
    FinalGather(const Gatherer& gatherer, uint32_t groups) : gatherer_(gatherer), round_(groups), state_(groups) {}

    // Appends to `out` the light of `groups` (ascending) at `from`. Rays are shared, decisions are not: a group's
    // value and sample count do not depend on which other groups are asked for. Returns the rays traced.
    uint64_t gather(const GatherFrom& from, std::span<const uint32_t> groups, const SparseLight& outgoing,
                    const FinalGatherOptions& options, std::vector<ReceiverLight>& out);

   private:
    struct State {
        Gathered sum;
        float mean = 0, squares = 0;  // Welford, over rounds, of the luminance
        uint32_t rounds = 0;
        bool done = false;

        void add(const Gathered& round);
        float varianceOfMean() const;
    };
    const Gatherer& gatherer_;
    GroupAccumulator<Gathered> round_;
    std::vector<State> state_;
};

}  // namespace dimmer::cook
