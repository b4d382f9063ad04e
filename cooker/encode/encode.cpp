#include <encode/encode.h>

#include <bake/sampling.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr int rounds_max = 8;
constexpr float moment_max = 9.9f;  // of the format's 9.98
// Keeps the normal equations solvable where the model is clamped on most of the normals.
constexpr float ridge = 1e-4f;

using Parameters = glm::vec3;  // r, b_x, b_y

const std::array<glm::vec3, 4> tilted_normals = {
    {{tilt_sin, 0, tilt_cos}, {0, tilt_sin, tilt_cos}, {-tilt_sin, 0, tilt_cos}, {0, -tilt_sin, tilt_cos}}};

struct Falloff {
    float value;
    Parameters slope;  // by r, b_x, b_y
};

// E(n) / E_z; see runtime/format/texel.h.
Falloff falloff(const Parameters& p, glm::vec3 n, DirectionModel model) {
    const float highlight = p.y * n.x + p.z * n.y + (1 - p.x) * n.z;
    const Parameters slope(1 - n.z, n.x, n.y);
    if (model == DirectionModel::Linear)
        return p.x + highlight > 0 ? Falloff{p.x + highlight, slope} : Falloff{0, Parameters(0)};
    return highlight > 0 ? Falloff{p.x + highlight, slope} : Falloff{p.x, {1, 0, 0}};
}

Parameters clamped(Parameters p) {
    return {std::clamp(p.x, 0.0f, 1.0f), std::clamp(p.y, -moment_max, moment_max),
            std::clamp(p.z, -moment_max, moment_max)};
}

float residual(const Parameters& p, glm::vec4 target, DirectionModel model) {
    float sum = 0;
    for (int i = 0; i < 4; ++i) {
        const float error = falloff(p, tilted_normals[static_cast<size_t>(i)], model).value - target[i];
        sum += error * error;
    }
    return sum;
}

// Gauss-Newton, as long as it helps.
Parameters refine(Parameters p, glm::vec4 target, DirectionModel model, float& best) {
    best = residual(p, target, model);
    for (int round = 0; round < rounds_max; ++round) {
        glm::mat3 normal(ridge);
        glm::vec3 gradient(0);
        for (int i = 0; i < 4; ++i) {
            const Falloff f = falloff(p, tilted_normals[static_cast<size_t>(i)], model);
            normal += glm::outerProduct(f.slope, f.slope);
            gradient += f.slope * (target[i] - f.value);
        }
        const Parameters next = clamped(p + glm::inverse(normal) * gradient);
        const float now = residual(next, target, model);
        if (!(now < best * 0.999f)) break;
        p = next;
        best = now;
    }
    return p;
}

}  // namespace

Highlight fitHighlight(const Gathered& light, DirectionModel model) {
    const float lux = luminance(light.irradiance_lux);
    if (!(lux > 0)) return {};
    const glm::vec4 target = light.tilted_lux / lux;
    const glm::vec2 across(target.x - target.z, target.y - target.w);
    const float mean = (target.x + target.y + target.z + target.w) / 4;
    // From where nothing is clamped, and from a lone lamp near the surface: the clamp parts the two.
    const Parameters open = clamped({(mean - tilt_cos) / (1 - tilt_cos), across / (2 * tilt_sin)});
    const Parameters lamp = clamped({0.05f, glm::max(glm::vec2(target.x, target.y) - tilt_cos, 0.0f) / tilt_sin -
                                                glm::max(glm::vec2(target.z, target.w) - tilt_cos, 0.0f) / tilt_sin});
    float open_residual, lamp_residual;
    const Parameters a = refine(open, target, model, open_residual), b = refine(lamp, target, model, lamp_residual);
    const Parameters& best = lamp_residual < open_residual ? b : a;
    return {best.x, best.y, best.z};
}

TexelRecord encodeTexel(const Gathered& light, const TexelEncoding& encoding) {
    const glm::vec3 stored = light.irradiance_lux * encoding.exposure;
    const Highlight fit = fitHighlight(light, encoding.direction_model);
    return {encodeColor(encoding.color_format, stored.x, stored.y, stored.z),
            encodeDirection(1, fit.ambient, fit.bx, fit.by)};
}

float chooseExposure(const Baked& baked, std::span<const float> max_weights) {
    constexpr double half_of_largest = 64512.0 / 2;  // of R11G11B10F's 10-bit channel, the smallest of both formats
    double largest = 0;
    // A record is stored as it is at weight 1, whether the game may set that or not.
    const auto consider = [&](const auto& row, auto&& valueOf) {
        glm::dvec3 sum(0);  // as largest weights may be as large as floats are
        for (const auto& l : row) {
            const glm::dvec3 value = valueOf(l.light);
            sum += static_cast<double>(max_weights[l.term]) * value;
            largest = std::max({largest, value.x, value.y, value.z});
        }
        largest = std::max({largest, sum.x, sum.y, sum.z});
    };
    for (size_t i = 0; i < baked.light.rows(); ++i)
        consider(baked.light.row(i), [](const Gathered& light) { return light.irradiance_lux; });
    for (const auto* probes : {&baked.grid.light, &baked.local_light})
        for (size_t i = 0; i < probes->rows(); ++i)
            consider(probes->row(i), [](const ProbeLight& light) { return light.radiance[0]; });
    if (!(largest > 0)) return 1;
    constexpr double most = exposure_log2_max;
    return static_cast<float>(std::exp2(std::clamp(std::floor(std::log2(half_of_largest / largest)), -most, most)));
}

}  // namespace dimmer::cook
