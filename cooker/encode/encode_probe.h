// From gathered radiance to stored probes.
#pragma once

#include <bake/gather.h>
#include <pack/pack_data.h>

namespace dimmer::cook {

struct ProbeEncoding {
    float exposure = 1;
    ColorFormat color_format = ColorFormat::R11G11B10F;
};

// De-ringed: mixed with its own mean over all directions as far as it takes that the decoded probe gives no normal a
// negative irradiance (two bands of harmonics ring about a lone lamp); most probes need nothing. Any sum of such
// records is free of it too.
ProbeRecord encodeProbe(const ProbeLight& light, const ProbeEncoding& encoding);

// What a shader reads.
ProbeLight decodeProbe(const ProbeRecord& record, const ProbeEncoding& encoding);

// The least irradiance over all normals, lux, of one channel.
float leastIrradiance(const ProbeLight& light, int channel);

// `share` of its bands 1 and 2, all of its mean.
ProbeLight flattened(const ProbeLight& light, float share);

// The largest share, 0 to 1, with which no channel is negative for any normal: as irradiance is its mean plus that
// share of the rest, mean / (mean - least).
float positiveShare(const ProbeLight& light);

}  // namespace dimmer::cook
