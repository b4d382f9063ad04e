// The last gather: many rays per receiver, as many for each term as its own noise asks for.
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
    bool aim_at_doors = true;          // rays towards the doors of the terms besides; off, for measuring against
    std::span<const float> floor_lux;  // per term: light below this need not be exact to a share of itself
};

// Per term, the light that need not be exact to a share of itself.
std::vector<float> noiseFloors(const Series& series, uint32_t group_count);
FinalGatherOptions finalGatherOptions(const BakeSettings& settings, std::span<const float> floors_lux);

// Rays come in rounds of this many; the spread of the rounds' means is the noise.
inline constexpr uint32_t rays_per_round = 32;

// One worker's scratch; not thread-safe, make one per thread. Light: Gathered for texels, ProbeLight for probes.
template <class Light>
class FinalGather {
   public:
    explicit FinalGather(const Gatherer& gatherer)
        : gatherer_(gatherer),
          round_(gatherer.paths().termCount()),
          state_(gatherer.paths().termCount()),
          aim_of_term_(gatherer.paths().termCount()),
          spared_variance_(gatherer.paths().termCount()),
          wanted_in_group_(gatherer.paths().groupCount()) {
        round_.wantNone();
    }

    // Appends to `out` the light of `terms` (ascending) at `from`. Rays are shared, decisions are not: a term's
    // value and sample count do not depend on which terms of other light groups are asked for. Of its own group, terms
    // that are not asked for count for it where it takes them along (DoorPaths::moreClosed). `ends`, when given: of the
    // first rays, and takes those of others, up to RowEnds::kept_max. `bounced`: terms (ascending) of which surfaces
    // are known to send light here; they go on until a ray has found some. Returns the rays traced.
    uint64_t gather(const GatherFrom& from, std::span<const uint32_t> terms, const SparseLight& outgoing,
                    const FinalGatherOptions& options, std::vector<LightOfTerm<Light>>& out, RowEnds* ends = nullptr,
                    std::span<const uint32_t> bounced = {});

   private:
    struct State {
        Light sum;
        float mean = 0, squares = 0;  // Welford, over rounds, of the luminance
        uint32_t rounds = 0;
        bool done = false;

        void add(const Light& round);
        float varianceOfMean() const;
    };
    void aim(const GatherFrom& from, std::span<const uint32_t> terms, const FinalGatherOptions& options);
    void want(uint32_t term, bool wanted);
    void takeAlong(uint32_t term, uint32_t into);
    bool aimPays(uint32_t term) const;
    void leaveAim(uint32_t term);
    static RowEnds* endsOfRound(RowEnds* row, uint32_t round);

    const Gatherer& gatherer_;
    std::vector<DoorAim> aims_;
    std::vector<uint32_t> wanted_in_aim_;  // terms that are not done and have not left it
    TermAccumulator<Light> round_;         // wants the terms that are not done
    std::vector<State> state_;
    std::vector<std::pair<uint32_t, uint32_t>> along_;  // terms not asked for, and what they count for
    std::vector<uint16_t> aim_of_term_;                 // of the terms that are asked for
    std::vector<float> spared_variance_;                // per term; see DoorAims
    std::vector<uint32_t> wanted_in_group_;
};

}  // namespace dimmer::cook
