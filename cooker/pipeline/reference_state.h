// The reference path tracer, asked about a state of light sets and doors.
#pragma once

#include <bake/progress.h>
#include <bake/reference.h>

#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace dimmer::cook {

struct ReferenceState {
    std::vector<glm::vec3> set_weights;  // per light set of the scene
    std::vector<bool> door_open;         // per door
    ReferenceOptions options(uint32_t seed) const { return {.seed = seed, .set_weights = set_weights}; }
};

// Reads e.g. "hall=0.5,door:front=1". What is not named is as in the runtime: sets at 1, or their maximum where that is
// smaller, doors closed. Doors are closed or open: what half open looks like is a matter of blending.
Expected<ReferenceState> readReferenceState(const Scene& scene, std::string_view state);

// The level as it stands: open doors are gone, or in their open poses.
Scene sceneInState(Scene scene, const ReferenceState& state);

// When a point has had enough paths: once the standard error of its luminance is at most `relative` * (|E| + floor).
struct ReferenceTarget {
    uint32_t paths_min = 256;  // fewer give no trustworthy error
    uint32_t paths_max = 16384;
    double relative = 0.01;
    double floor_lux = 0;
};

// Refines every estimate until the target is met; on all cores, the same result on any number of them.
void refineAll(const ReferenceTracer& tracer, std::span<const ReferencePoint> points, const ReferenceTarget& target,
               std::span<ReferenceEstimate> estimates, Progress& progress);
// The same with paths of any kind: refine(i, estimates[i], paths) adds so many.
using RefinePoint = std::function<void(size_t, ReferenceEstimate&, uint32_t)>;
void refineEach(const RefinePoint& refine, const ReferenceTarget& target, std::span<ReferenceEstimate> estimates,
                Progress& progress);

}  // namespace dimmer::cook
