// How far light in the open is from the truth.
#pragma once

namespace dimmer::cook {

// Irradiance on 14 normals all around that `interpolated` misses of `traced` (nine coefficients of radiance each), as a
// share of it and `floor_lux`: mean, at most `error_max` each.
float gridError(const float* interpolated, const float* traced, float floor_lux, float error_max);

}  // namespace dimmer::cook
