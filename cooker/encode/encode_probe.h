// From gathered radiance to stored probes.
#pragma once

#include <bake/gather.h>
#include <pack/pack_data.h>

namespace dimmer::cook {

struct ProbeEncoding {
    float exposure = 1;
    ColorFormat color_format = ColorFormat::R11G11B10F;
};

// Windowed as far as it takes that the decoded probe gives no normal a negative irradiance (what a lamp in one
// direction does to two bands of harmonics); most probes need none. Any sum of such records is free of it too.
ProbeRecord encodeProbe(const ProbeLight& light, const ProbeEncoding& encoding);

// What a shader reads.
ProbeLight decodeProbe(const ProbeRecord& record, const ProbeEncoding& encoding);

// The least irradiance over all normals, lux, of one channel.
float leastIrradiance(const ProbeLight& light, int channel);

// Coefficients of band l divided by 1 + strength l^2 (l + 1)^2: the window that keeps the Laplacian small (Sloan 2008,
// Stupid Spherical Harmonics Tricks).
ProbeLight windowed(const ProbeLight& light, float strength);

}  // namespace dimmer::cook
