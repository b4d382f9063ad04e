// What a pack says of points, measured against the reference path tracer.
#pragma once

#include <charts/unwrap.h>
#include <pipeline/light_error.h>
#include <pipeline/reference_state.h>
#include <trace/ray_scene.h>

#include <span>
#include <vector>

namespace dimmer::cook {

// The reference's standard error over the error that is measured, at most, for a figure to be believed.
inline constexpr double converged_share = 0.1;

struct Measured {
    std::vector<ReferenceEstimate> estimates;
    std::vector<LightPair> pairs;
    ErrorFigures figures;
};

// Luminances in lux at points, against paths until the reference is a tenth of what is measured, or the limit.
Measured measure(const ReferenceTracer& tracer, std::span<const ReferencePoint> points, std::span<const double> values,
                 double floor_lux, uint32_t paths_max, Progress& progress);

std::vector<LightPair> pairsOf(std::span<const double> values, std::span<const ReferenceEstimate> estimates);

// A place on a surface that something lies on, or inside of something closed: a good part of what the point sees are
// backs. Half would do in the middle of it, but where a wall meets a floor inside, half of the rays end on the floor's
// front.
bool hidden(const RayScene& rays, glm::vec3 position_m, const TangentFrame& frame, uint32_t seed);

}  // namespace dimmer::cook
