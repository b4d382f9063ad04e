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

// Of each tilted normal.
using Four [[gnu::vector_size(16)]] = float;
using FourFlags [[gnu::vector_size(16)]] = int;
constexpr Four normals_x = {tilt_sin, 0, -tilt_sin, 0}, normals_y = {0, tilt_sin, 0, -tilt_sin};

// Gauss-Newton's step from the errors on the four normals: depends on no more than which of them are clamped.
using Step = std::array<Parameters, 4>;
Step stepOf(uint32_t open, DirectionModel model) {
    glm::mat3 normal(ridge);
    Step slopes;  // of E(n) / E_z
    for (uint32_t i = 0; i < 4; ++i) {
        const bool is_open = open >> i & 1;
        slopes[i] = is_open ? Parameters(1 - tilt_cos, normals_x[i], normals_y[i])
                            : Parameters(model == DirectionModel::Linear ? 0 : 1, 0, 0);
        normal += glm::outerProduct(slopes[i], slopes[i]);
    }
    const glm::mat3 inverse = glm::inverse(normal);
    for (Parameters& slope : slopes) slope = inverse * slope;
    return slopes;
}
const Step& stepFor(uint32_t open, DirectionModel model) {
    using Steps = std::array<Step, 16>;
    static const std::array<Steps, 2> steps = [] {
        std::array<Steps, 2> all;
        for (const auto m : {DirectionModel::Ahd, DirectionModel::Linear})
            for (uint32_t i = 0; i < 16; ++i) all[static_cast<size_t>(m)][i] = stepOf(i, m);
        return all;
    }();
    return steps[static_cast<size_t>(model)][open];
}

Parameters clamped(Parameters p) {
    return {std::clamp(p.x, 0.0f, 1.0f), std::clamp(p.y, -moment_max, moment_max),
            std::clamp(p.z, -moment_max, moment_max)};
}

// Of the model on the four normals.
struct Errors {
    Four of;
    uint32_t open = 0;  // a bit for each normal that is not clamped
    float square = 0;
};
// E(n) / E_z: see runtime/format/texel.h.
Errors errorsOf(const Parameters& p, Four target, DirectionModel model) {
    const Four highlight = p.y * normals_x + p.z * normals_y + (1 - p.x) * tilt_cos, sum = p.x + highlight;
    const bool linear = model == DirectionModel::Linear;
    const FourFlags open = (linear ? sum : highlight) > 0;
    Errors errors;
    errors.of = (open ? sum : Four{} + (linear ? 0 : p.x)) - target;
    for (size_t i = 0; i < 4; ++i) {
        errors.open |= static_cast<uint32_t>(open[i]) & 1u << i;
        errors.square += errors.of[i] * errors.of[i];
    }
    return errors;
}

// Gauss-Newton, as long as it helps.
Parameters refine(Parameters p, Four target, DirectionModel model, float& best) {
    Errors errors = errorsOf(p, target, model);
    for (int round = 0; round < rounds_max; ++round) {
        const Step& step = stepFor(errors.open, model);
        Parameters next = p;
        for (size_t i = 0; i < 4; ++i) next -= step[i] * errors.of[i];
        next = clamped(next);
        const Errors now = errorsOf(next, target, model);
        if (!(now.square < errors.square * 0.999f)) break;
        p = next;
        errors = now;
    }
    best = errors.square;
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
    const Four on_normals = {target.x, target.y, target.z, target.w};
    const Parameters a = refine(open, on_normals, model, open_residual),
                     b = refine(lamp, on_normals, model, lamp_residual);
    const Parameters& best = lamp_residual < open_residual ? b : a;
    return {best.x, best.y, best.z};
}

TexelRecord encodeTexel(const Gathered& light, const TexelEncoding& encoding) {
    const glm::vec3 stored = light.irradiance_lux * encoding.exposure;
    const Highlight fit = fitHighlight(light, encoding.direction_model);
    return {encodeColor(encoding.color_format, stored.x, stored.y, stored.z),
            encodeDirection(1, fit.ambient, fit.bx, fit.by)};
}

namespace {

// visit(row, valueOf): what is stored in a colour format of each receiver's terms.
void forEachRow(const Baked& baked, auto&& visit) {
    for (size_t i = 0; i < baked.light.rows(); ++i)
        visit(baked.light.row(i), [](const Gathered& light) { return light.irradiance_lux; });
    for (const auto* probes : {&baked.grid.light, &baked.local_light})
        for (size_t i = 0; i < probes->rows(); ++i)
            visit(probes->row(i), [](const ProbeLight& light) { return light.radiance[0]; });
}

}  // namespace

uint32_t brightestTerm(const Baked& baked, std::span<const float> max_weights) {
    uint32_t brightest = 0;
    double largest = 0;
    forEachRow(baked, [&](const auto& row, auto&& valueOf) {
        for (const auto& l : row) {
            const glm::dvec3 value = static_cast<double>(max_weights[l.term]) * glm::dvec3(valueOf(l.light));
            const double most = std::max({value.x, value.y, value.z});
            if (most > largest) largest = most, brightest = l.term;
        }
    });
    return brightest;
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
    forEachRow(baked, consider);
    if (!(largest > 0)) return 1;
    constexpr double most = exposure_log2_max;
    return static_cast<float>(std::exp2(std::clamp(std::floor(std::log2(half_of_largest / largest)), -most, most)));
}

}  // namespace dimmer::cook
