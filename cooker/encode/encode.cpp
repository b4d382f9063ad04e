#include <encode/encode.h>

#include <bake/sampling.h>
#include <format/texel.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {

HighlightFit fitHighlight(const Gathered& light) {
    const float lux = luminance(light.irradiance_lux);
    if (!(lux > 0)) return {};
    const glm::vec3 c = light.moment_lux / lux;
    // |c - r (0,0,2/3)| = 1 - r  <=>  5/9 r^2 - (2 - 4/3 c_z) r + 1 - |c|^2 = 0; the smaller root is the share.
    const float half_b = 1 - 2.0f / 3.0f * c.z;
    const float discriminant = std::max(0.0f, half_b * half_b - 5.0f / 9.0f * (1 - glm::dot(c, c)));
    const float ambient = std::clamp((half_b - std::sqrt(discriminant)) * 9.0f / 5.0f, 0.0f, 1.0f);
    glm::vec3 d = c - glm::vec3(0, 0, ambient * 2.0f / 3.0f);
    const float length = glm::length(d);
    if (!(length > 1e-6f)) return {};
    d /= length;
    if (d.z < highlight_z_min) {
        const float across = std::sqrt(d.x * d.x + d.y * d.y);
        const float scale = std::sqrt(1 - highlight_z_min * highlight_z_min) / std::max(across, 1e-6f);
        d = {d.x * scale, d.y * scale, highlight_z_min};
    }
    return {ambient, d};
}

TexelRecord encodeTexel(const Gathered& light, float exposure, ColorFormat format) {
    const glm::vec3 stored = light.irradiance_lux * exposure;
    const HighlightFit fit = fitHighlight(light);
    const float share = 1 - fit.ambient;
    return {encodeColor(format, stored.x, stored.y, stored.z),
            encodeDirection(1, fit.ambient, share * fit.direction.x / fit.direction.z,
                            share * fit.direction.y / fit.direction.z)};
}

float chooseExposure(const Baked& baked, std::span<const float> max_weights) {
    constexpr float half_of_largest = 64512.0f / 2;  // of R11G11B10F's 10-bit channel, the smallest of both formats
    float largest = 0;
    for (size_t i = 0; i < baked.light.rows(); ++i) {
        glm::vec3 sum(0);
        for (const ReceiverLight& l : baked.light.row(i)) sum += max_weights[l.group] * l.light.irradiance_lux;
        largest = std::max({largest, sum.x, sum.y, sum.z});
    }
    if (!(largest > 0) || !std::isfinite(largest)) return 1;
    return std::exp2(std::clamp(std::floor(std::log2(half_of_largest / largest)), -40.0f, 40.0f));
}

}  // namespace dimmer::cook
