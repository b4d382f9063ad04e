// Where a pack's error comes from: the baker's approximations switched off one after another at a few points.
#pragma once

#include <pipeline/light_error.h>
#include <pipeline/reference_state.h>
#include <pipeline/verify.h>

#include <map>
#include <string>
#include <vector>

namespace dimmer::cook {

// The steps from the truth to what a pack shows, each against the one before it. Means of |difference| over
// (E_ref + floor), with the noise of both sides taken off in quadrature.
//   series_expansion    stored bounces, texel by texel, instead of paths; gathered at the point itself
//   texel_size          gathered at the texels' points, sharpened and filtered, instead of at the point
//   activity_threshold  without the light sets that are not active there
//   noise               the cook's own rays (its filter, and what sharpening holds back) instead of many
// They need not add up to the whole error: they can cancel.
using ErrorCauses = std::map<std::string, double>;

// Whether the pack's settings can be read and give its pages again: what both functions below need. Cost: a cook's
// charts.
Expected<void> checkRebake(const Scene& scene, const Pack& pack);

// Bakes the first passes of `scene` again, as the pack's settings say, and gathers at `points`. `pairs`: per point, the
// pack's light and the reference in this state; doors are closed. Cost: the cook without its last pass, and some 80,000
// rays per point.
Expected<ErrorCauses> errorCauses(const Scene& scene, const Pack& pack, std::span<const VerifyPoint> points,
                                  std::span<const LightPair> pairs, const ReferenceState& state, double floor_lux,
                                  Progress& progress);

// The error of encoding, blending and decoding alone, for every colour format, directional model and 1, 3 and 8 of the
// sets that shine most at each point; against the same rays' own irradiance on 16 tilted normals. Cost as above.
Expected<std::vector<FormatError>> formatErrors(const Scene& scene, const Pack& pack,
                                                std::span<const VerifyPoint> points, Progress& progress);

}  // namespace dimmer::cook
