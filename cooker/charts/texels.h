// The receivers of a bake: lightmap texels with their sample points.
#pragma once

#include <bake/progress.h>
#include <charts/unwrap.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

struct SamplePoint {
    glm::vec3 position_m;  // lifted off the surface, ready to start a ray
    uint32_t face = 0;     // its frame gives normal and tangents
};

// A sample point as it is kept, in half of that memory: a texel has eight.
struct TexelPoint {
    static constexpr uint32_t steps = 1u << 16;  // of a texel

    uint32_t face = 0;
    uint16_t x = 0, y = 0;  // within the texel, in steps

    bool operator==(const TexelPoint&) const = default;
};

// A texel that holds a copy of another one: padding around charts, and texels that no light can reach.
struct FillTexel {
    uint32_t address = 0;  // TexelAddress
    uint32_t source = 0;   // index of a receiver
};

struct Texels {
    // Per receiver, structure of arrays.
    std::vector<uint32_t> address;       // TexelAddress
    std::vector<float> area_m2;          // lit surface inside it
    std::vector<glm::vec3> reflectance;  // of what stops light there; 0 where nothing does
    std::vector<uint32_t> first_sample;  // one more than receivers
    std::vector<TexelPoint> samples;
    std::vector<FillTexel> fills;
    std::vector<uint32_t> receiver_at;  // per page texel: its receiver or the one standing in for it; no_index: none

    size_t size() const { return address.size(); }
    uint32_t sampleCount(size_t receiver) const { return first_sample[receiver + 1] - first_sample[receiver]; }
    const TexelPoint& sample(size_t receiver, uint32_t i) const { return samples[first_sample[receiver] + i]; }
    uint32_t face(size_t receiver) const { return sample(receiver, 0).face; }
};

// Up to `samples_max` points per texel, Halton-distributed over what the charts cover of it. Points inside closed
// geometry are dropped, and so are points that a wall parts from the texel's others; where all lie inside a closed
// door's leaf, they stay: an opening uncovers them. Deterministic.
Texels sampleTexels(const RayScene& rays, const Unwrap& unwrap, uint32_t samples_max, Progress* progress = nullptr);

// Where on its page a sample point lies, in texels.
glm::vec2 placeOnPage(const Texels& texels, size_t receiver, uint32_t i);
SamplePoint samplePoint(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, size_t receiver, uint32_t i);

// The receiver so many texels away in the same chart; no_index where the chart has none of its own there.
uint32_t neighbourInChart(const Unwrap& unwrap, const Texels& texels, size_t receiver, int dx, int dy);

// Which receiver a ray's hit reads; no_index for surfaces that receive no light.
uint32_t receiverOf(const Unwrap& unwrap, const Texels& texels, const Hit& hit);

}  // namespace dimmer::cook
