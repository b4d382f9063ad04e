// Models lit by light grids against the reference path tracer.
#pragma once

#include <pipeline/measured_light.h>
#include <pipeline/verify.h>

namespace dimmer::cook {

// At random places of the models that stand, by area, with the light that a shader gives them: positions and transfers
// interpolated between vertices. Places that nobody can see, and those that stay black, do not count; no points where
// no model stands. `rays`: the level in the state of `options`.
Expected<ModelFigures> verifyModels(const ReferenceTracer& tracer, const RayScene& rays, const Pack& pack,
                                    const VerifyOptions& options, double floor_lux, Progress& progress);

}  // namespace dimmer::cook
