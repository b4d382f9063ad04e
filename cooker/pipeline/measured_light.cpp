#include <pipeline/measured_light.h>

#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

// First look at a point, good enough to say how large the error is and so how many paths it takes.
constexpr double first_relative = 0.02;
constexpr uint32_t hidden_rays = 16;
constexpr float hidden_lift_m = 1e-3f, in_plane_share = 0.3f;

// Paths that found nothing have no noise, and yet know little of what few would find, as through a small window: where
// the pack has light, as many are asked as there may be.
void askWhereNoneFound(const ReferenceTracer& tracer, std::span<const ReferencePoint> points,
                       std::span<const double> values, double least_lux, uint32_t paths_max,
                       std::span<ReferenceEstimate> estimates) {
    tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
        const uint32_t so_far = estimates[i].paths();
        if (values[i] > least_lux && so_far < paths_max && estimates[i].value().irradiance_lux == glm::vec3(0))
            tracer.refine(estimates[i], points[i], paths_max - so_far);
    });
}

}  // namespace

std::vector<LightPair> pairsOf(std::span<const double> values, std::span<const ReferenceEstimate> estimates) {
    std::vector<LightPair> out;
    for (size_t i = 0; i < values.size(); ++i) {
        const ReferenceValue v = estimates[i].value();
        out.push_back(
            {values[i], static_cast<double>(luminance(v.irradiance_lux)), static_cast<double>(v.luminance_error_lux)});
    }
    return out;
}

Measured measure(const ReferenceTracer& tracer, std::span<const ReferencePoint> points, std::span<const double> values,
                 double floor_lux, uint32_t paths_max, Progress& progress) {
    Measured m{std::vector<ReferenceEstimate>(points.size()), {}, {}};
    ReferenceTarget target{.paths_max = paths_max, .relative = first_relative, .floor_lux = floor_lux};
    target.paths_min = std::min(target.paths_min, paths_max);
    for (int round = 0; round < 2; ++round) {
        refineAll(tracer, points, target, m.estimates, progress);
        askWhereNoneFound(tracer, points, values, target.relative * floor_lux, paths_max, m.estimates);
        m.pairs = pairsOf(values, m.estimates);
        m.figures = lightError(m.pairs, floor_lux);
        target.relative = converged_share * m.figures.measured_mean;
    }
    return m;
}

bool hidden(const RayScene& rays, glm::vec3 position_m, const TangentFrame& frame, uint32_t seed) {
    const float lift_m = liftOff(position_m, hidden_lift_m), way_m = (1 - in_plane_share) * lift_m;
    const glm::vec3 lifted_m = position_m + lift_m * frame.normal;
    if (rays.reach(lifted_m, -frame.normal, way_m, Surfaces::All) < way_m) return true;
    uint32_t backs = 0;
    for (uint32_t i = 0; i < hidden_rays; ++i) {
        const glm::vec3 d = cosineDirection(sequence2d(i, seed));
        const glm::vec3 direction = frame.tangent * d.x + frame.bitangent * d.y + frame.normal * d.z;
        const auto hit = rays.nearest(lifted_m, direction, far_away_m, seed + i);
        if (!hit || !hit->back) continue;
        backs += !rays.scene().materials[rays.triangles()[hit->triangle].material].double_sided;
    }
    return 4 * backs > hidden_rays;
}

}  // namespace dimmer::cook
