// What `dimmer bench` changes from frame to frame.
#pragma once

#include <dimmer/light_state.h>

#include <functional>
#include <string>
#include <vector>

namespace dimmer::cook {

struct BenchCase {
    std::string name;
    // Changes the state for a frame; frames are counted from 0.
    std::function<Expected<void>(LightState&, uint32_t frame)> change;
    uint32_t sets = 0;  // light sets that every frame changes; 0 where that is not what the case is about
};

// Where the pack has a global grid the last case moves models, which stay: the runtime needs room for bench_probes.
std::vector<BenchCase> casesOf(const Pack& pack);
inline constexpr uint32_t bench_models = 64, bench_probes = 64 * bench_models;

// Every set at 1 (its maximum, where that is smaller) and every door closed.
Expected<void> resetElements(LightState& state);

}  // namespace dimmer::cook
