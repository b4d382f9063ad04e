#include <pipeline/measured_light.h>

#include <bake/sampling.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

// First look at a point, good enough to say how large the error is and so how many paths it takes.
constexpr double first_relative = 0.02;
constexpr uint32_t hidden_rays = 16;

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
        m.pairs = pairsOf(values, m.estimates);
        m.figures = lightError(m.pairs, floor_lux);
        target.relative = converged_share * m.figures.measured_mean;
    }
    return m;
}

bool hidden(const RayScene& rays, glm::vec3 position_m, const TangentFrame& frame, uint32_t seed) {
    uint32_t backs = 0;
    for (uint32_t i = 0; i < hidden_rays; ++i) {
        const glm::vec3 d = cosineDirection(sequence2d(i, seed));
        const glm::vec3 direction = frame.tangent * d.x + frame.bitangent * d.y + frame.normal * d.z;
        const auto hit = rays.nearest(position_m + 1e-3f * frame.normal, direction, 1e30f, seed + i);
        if (!hit || !hit->back) continue;
        backs += !rays.scene().materials[rays.triangles()[hit->triangle].material].double_sided;
    }
    return 4 * backs > hidden_rays;
}

}  // namespace dimmer::cook
