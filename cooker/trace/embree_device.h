// Embree devices.
#pragma once

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

namespace dimmer::cook {

// The first to ask TBB for work decides how all of its workers round, and Embree, while it builds, has denormal numbers
// flushed to zero: asked by Embree first, as in a cook that finds its charts in the cache, they would make another
// pack.
inline RTCDevice newEmbreeDevice() {
    tbb::parallel_for(0, 1, [](int) {});
    return rtcNewDevice(nullptr);
}

}  // namespace dimmer::cook
