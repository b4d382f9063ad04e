#include <bake/reference_sky.h>

#include <bake/sampling.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dimmer::cook {
namespace {

// The height of a row's upper edge above the equator, on the unit sphere: a texel's solid angle is uniform in it.
double heightAt(const Image& image, double row) {
    return std::cos(std::numbers::pi * row / image.height);
}

}  // namespace

ReferenceSky::ReferenceSky(const Scene& scene, bool wanted) : scene_(scene) {
    if (!wanted || !scene.sky_image) return;
    const Image& image = *scene.sky_image;
    up_to_.reserve(image.texels.size());
    for (uint32_t y = 0; y < image.height; ++y) {
        const double solid_angle = 2 * std::numbers::pi / image.width * (heightAt(image, y) - heightAt(image, y + 1));
        for (uint32_t x = 0; x < image.width; ++x) {
            const glm::vec3 texel(image.texels[size_t{y} * image.width + x]);
            flux_ += solid_angle * static_cast<double>(luminance(texel * scene.sky_radiance_cd_m2));
            up_to_.push_back(flux_);
        }
    }
}

glm::vec3 ReferenceSky::sample(float choice, glm::vec2 u) const {
    const Image& image = *scene_.sky_image;
    const auto found = std::ranges::upper_bound(up_to_, static_cast<double>(choice) * flux_);
    const auto texel = static_cast<size_t>(std::min(found, up_to_.end() - 1) - up_to_.begin());
    const auto row = static_cast<double>(texel / image.width), column = static_cast<double>(texel % image.width);
    // In double: at the zenith 1 - y^2 is next to nothing, and a direction in another row has another density.
    const double y = std::lerp(heightAt(image, row), heightAt(image, row + 1), static_cast<double>(u.x));
    const double across = std::sqrt(std::max(0.0, (1 - y) * (1 + y)));
    // Azimuth 0, where +x is, is the image's middle; see skyRadiance.
    const double azimuth = 2 * std::numbers::pi * ((column + static_cast<double>(u.y)) / image.width - 0.5);
    return glm::dvec3(across * std::cos(azimuth), y, across * std::sin(azimuth));
}

float ReferenceSky::pdf(glm::vec3 radiance_cd_m2) const {
    return empty() ? 0 : luminance(radiance_cd_m2) / static_cast<float>(flux_);
}

}  // namespace dimmer::cook
