#include <bake/sky.h>

#include <bake/sampling.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dimmer::cook {
namespace {

// What sends so many times the mean sky's radiance is drawn apart.
constexpr double peak_over_mean = 16;
constexpr std::array all_parts = {SkySampler::Rest, SkySampler::Peaks};

// By luminance a blue sun would hardly be asked for.
float brightest(glm::vec3 radiance) {
    return std::max({radiance.x, radiance.y, radiance.z});
}

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

SkySampler::SkySampler(const Scene& scene) : scene_(scene), peaks_above_(std::numeric_limits<float>::max()) {
    if (!scene.sky_image) return;
    const Table all = tableOf(Rest);
    const double mean = static_cast<double>(all.flux) / (4 * std::numbers::pi);
    peaks_above_ = static_cast<float>(std::min(peak_over_mean * mean, double{std::numeric_limits<float>::max()}));
    for (const Part part : all_parts) tables_[part] = tableOf(part);
    if (!empty()) peaks_share_ = tables_[Peaks].flux / (tables_[Peaks].flux + tables_[Rest].flux);
}

SkySampler::Part SkySampler::partOf(glm::vec3 radiance_cd_m2) const {
    return brightest(radiance_cd_m2) > peaks_above_ ? Peaks : Rest;
}

SkySampler::Table SkySampler::tableOf(Part part) const {
    const Image& image = *scene_.sky_image;
    std::vector<double> row_weights(image.height), weights(image.width);
    Table table;
    table.column_cdf.resize(image.texels.size());
    for (uint32_t row = 0; row < image.height; ++row) {
        const size_t first = size_t{row} * image.width;
        for (uint32_t x = 0; x < image.width; ++x) {
            const glm::vec3 radiance = glm::vec3(image.texels[first + x]) * scene_.sky_radiance_cd_m2;
            weights[x] = partOf(radiance) == part ? static_cast<double>(brightest(radiance)) : 0;
        }
        row_weights[row] = solidAngle(image, row) * cumulate(weights, &table.column_cdf[first]);
    }
    table.row_cdf.resize(image.height);
    table.flux = static_cast<float>(cumulate(row_weights, table.row_cdf.data()));
    return table.flux > 0 ? table : Table();
}

uint32_t SkySampler::samplesOf(Part part, uint32_t samples) const {
    if (samples == 0 || tables_[part].empty()) return 0;
    if (tables_[Peaks].empty()) return samples;
    const auto of_peaks = std::max(1u, static_cast<uint32_t>(peaks_share_ * static_cast<float>(samples) + 0.5f));
    return part == Peaks ? of_peaks : std::max(1u, samples - std::min(of_peaks, samples));
}

SkySample SkySampler::sample(Part part, glm::vec2 u) const {
    const Image& image = *scene_.sky_image;
    const Table& table = tables_[part];
    const Drawn row = draw(table.row_cdf.data(), image.height, u.x);
    const size_t first = row.index * image.width;
    const Drawn column = draw(&table.column_cdf[first], image.width, u.y);
    // Uniform over the texel's solid angle: the height above the equator is.
    const double step = std::numbers::pi / image.height;
    const auto top = static_cast<float>(std::cos(static_cast<double>(row.index) * step));
    const auto bottom = static_cast<float>(std::cos(static_cast<double>(row.index + 1) * step));
    const float y = glm::mix(top, bottom, row.within), across = std::sqrt(std::max(0.0f, 1 - y * y));
    const float azimuth = (static_cast<float>(column.index) + column.within) / static_cast<float>(image.width) - 0.5f;
    const float phi = 2 * pi * azimuth;
    return {{across * std::cos(phi), y, across * std::sin(phi)},
            glm::vec3(image.texels[first + column.index]) * scene_.sky_radiance_cd_m2};
}

float SkySampler::density(glm::vec3 radiance_cd_m2, uint32_t samples) const {
    const Part part = partOf(radiance_cd_m2);
    if (tables_[part].empty()) return 0;
    return static_cast<float>(samplesOf(part, samples)) * brightest(radiance_cd_m2) / tables_[part].flux;
}

}  // namespace dimmer::cook
