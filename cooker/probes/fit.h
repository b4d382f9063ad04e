// Light of probes such that what is interpolated between them comes closest to what was traced.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// Nine coefficients of three channels, or of three states.
using FitValue = std::array<float, 27>;

// A place where light was traced, and the shares of the probes in what a game would read there.
struct FitSite {
    std::array<uint32_t, 4> probes{};
    std::array<float, 4> shares{};
    float importance = 1;  // of its squared error
};

// The least-squares light of the probes (as Kavan, Bargteil and Sloan 2011 have it for vertices): minimises the sum
// over sites of importance |interpolated - target|^2, and a little of the distance from `probes` as given, which is
// what was traced there: it decides where sites are few. By conjugate gradients, in an order of their own:
// deterministic. Ends when what is left to mend is `tolerance` of the light. `own`, where it is not empty: per probe
// the importance of what was traced there, which counts no more than that (beside a lamp it is a thousand times what
// the sites around have); 0: nothing was, and the mean of the sites that it counts at stands for it, where there are
// any.
void fitProbes(std::span<const FitSite> sites, std::span<const FitValue> targets, std::span<FitValue> probes,
               float tolerance = 1e-3f, std::span<const float> own = {});

}  // namespace dimmer::cook
