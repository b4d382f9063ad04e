#include <bake/sky.h>

#include <bake/sampling.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// Index of the interval of ascending cumulated shares that `u` falls into, and `u` stretched over it.
struct Drawn {
    size_t index;
    float within;
};
Drawn draw(const float* cdf, size_t count, float u) {
    const auto index = static_cast<size_t>(std::upper_bound(cdf, cdf + count - 1, u) - cdf);
    const float below = index > 0 ? cdf[index - 1] : 0, share = cdf[index] - below;
    return {index, share > 0 ? std::clamp((u - below) / share, 0.0f, 1.0f) : 0.5f};
}

// Steradians of a texel in this row: exact, between two parallels.
double solidAngle(const Image& image, uint32_t row) {
    const double step = std::numbers::pi / image.height;
    return 2 * std::numbers::pi / image.width * (std::cos(row * step) - std::cos((row + 1) * step));
}

// Replaces weights by their cumulated shares; returns their sum. Without weight: all in the last.
double cumulate(const std::vector<double>& weights, float* cdf) {
    double sum = 0, so_far = 0;
    for (double w : weights) sum += w;
    for (size_t i = 0; i < weights.size(); ++i) {
        so_far += weights[i];
        cdf[i] = sum > 0 ? static_cast<float>(so_far / sum) : 0.0f;
    }
    cdf[weights.size() - 1] = 1;
    return sum;
}

}  // namespace

glm::vec3 skyRadiance(const Scene& scene, glm::vec3 direction) {
    if (!scene.sky_image) return scene.sky_radiance_cd_m2;
    const Image& image = *scene.sky_image;
    const float azimuth = 0.5f + std::atan2(direction.z, direction.x) / (2 * pi);
    const float polar = std::atan2(glm::length(glm::vec2(direction.x, direction.z)), direction.y) / pi;
    const auto texel = [](float share, uint32_t count) {
        return std::min(static_cast<uint32_t>(std::max(share, 0.0f) * static_cast<float>(count)), count - 1);
    };
    const size_t i = size_t{texel(polar, image.height)} * image.width + texel(azimuth, image.width);
    return glm::vec3(image.texels[i]) * scene.sky_radiance_cd_m2;
}

SkySampler::SkySampler(const Scene& scene) : scene_(scene) {
    if (!scene.sky_image) return;
    const Image& image = *scene.sky_image;
    std::vector<double> row_weights(image.height), weights(image.width);
    column_cdf_.resize(image.texels.size());
    for (uint32_t row = 0; row < image.height; ++row) {
        for (uint32_t x = 0; x < image.width; ++x)
            weights[x] = static_cast<double>(
                luminance(glm::vec3(image.texels[size_t{row} * image.width + x]) * scene.sky_radiance_cd_m2));
        row_weights[row] = solidAngle(image, row) * cumulate(weights, &column_cdf_[size_t{row} * image.width]);
    }
    std::vector<float> row_cdf(image.height);
    flux_ = static_cast<float>(cumulate(row_weights, row_cdf.data()));
    if (flux_ > 0) row_cdf_ = std::move(row_cdf);
}

SkySample SkySampler::sample(glm::vec2 u) const {
    const Image& image = *scene_.sky_image;
    const Drawn row = draw(row_cdf_.data(), image.height, u.x);
    const size_t first = row.index * image.width;
    const Drawn column = draw(&column_cdf_[first], image.width, u.y);
    // Uniform over the texel's solid angle: the height above the equator is.
    const double step = std::numbers::pi / image.height;
    const auto top = static_cast<float>(std::cos(static_cast<double>(row.index) * step));
    const auto bottom = static_cast<float>(std::cos(static_cast<double>(row.index + 1) * step));
    const float y = glm::mix(top, bottom, row.within), across = std::sqrt(std::max(0.0f, 1 - y * y));
    const float azimuth = (static_cast<float>(column.index) + column.within) / static_cast<float>(image.width) - 0.5f;
    const float phi = 2 * pi * azimuth;
    const glm::vec3 radiance = glm::vec3(image.texels[first + column.index]) * scene_.sky_radiance_cd_m2;
    return {{across * std::cos(phi), y, across * std::sin(phi)}, radiance, pdf(radiance)};
}

float SkySampler::pdf(glm::vec3 radiance_cd_m2) const {
    return luminance(radiance_cd_m2) / flux_;
}

}  // namespace dimmer::cook
