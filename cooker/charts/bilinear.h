// What bilinear filtering makes of the pages' texels.
#pragma once

#include <charts/texels.h>

#include <vector>

namespace dimmer::cook {

// How much of a receiver's value is shown.
struct Tap {
    uint32_t receiver;
    float weight;
};

class BilinearTaps {
   public:
    BilinearTaps(const Unwrap& unwrap, const Texels& texels);

    // What a texel of the pages holds the value of, padding included; no_index where it stays black.
    uint32_t shownAt(uint32_t page, glm::ivec2 texel) const;

    // What is shown of receivers in the mean over the points of one: itself first, then those around it. Weights add up
    // to 1; black texels, and those of another tangent frame, count as the receiver itself. Thread-safe.
    void around(uint32_t receiver, std::vector<Tap>& taps) const;

   private:
    bool framesAgree(uint32_t a, uint32_t b) const;

    const Unwrap& unwrap_;
    const Texels& texels_;
    std::vector<uint32_t> shown_;  // per page texel
};

}  // namespace dimmer::cook
