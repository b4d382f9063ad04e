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
};

std::vector<BenchCase> casesOf(const Pack& pack);

// Every set at 1 (its maximum, where that is smaller) and every door closed.
Expected<void> resetElements(LightState& state);

}  // namespace dimmer::cook
