// Embree devices.
#pragma once

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

#include <glm/glm.hpp>
#include <new>

namespace dimmer::cook {

// The first to ask TBB for work decides how all of its workers round, and Embree, while it builds, has denormal numbers
// flushed to zero: asked by Embree first, as in a cook that finds its charts in the cache, they would make another
// pack.
inline RTCDevice newEmbreeDevice() {
    tbb::parallel_for(0, 1, [](int) {});
    return rtcNewDevice(nullptr);
}

// Triangles of three vertices each, by `corner(t, i)`: to be committed and attached. Throws where there is no memory.
template <class Corner>
RTCGeometry newTriangles(RTCDevice device, size_t count, const Corner& corner) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* positions = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), count * 3));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), count));
    if (!positions || !indices) {
        rtcReleaseGeometry(geometry);
        throw std::bad_alloc();
    }
    for (size_t t = 0; t < count; ++t)
        for (size_t i = 0; i < 3; ++i) {
            const glm::vec3 p = corner(t, static_cast<int>(i));
            const size_t vertex = t * 3 + i;
            for (int k = 0; k < 3; ++k) positions[vertex * 3 + static_cast<size_t>(k)] = p[k];
            indices[vertex] = static_cast<unsigned>(vertex);
        }
    return geometry;
}

}  // namespace dimmer::cook
