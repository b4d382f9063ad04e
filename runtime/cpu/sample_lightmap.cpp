// The CPU twin of shaders/include/dimmer/sample.glsl and of the sampler that it reads through.
#include <dimmer/cpu_runtime.h>

#include <format/texel.h>

#include <algorithm>
#include <cmath>

namespace dimmer {
namespace {

// The two texels that a bilinear filter mixes along one axis; centres lie at +0.5, edges are clamped.
struct Tap {
    uint32_t first, second;
    float second_share;
};

Tap tap(float coordinate, uint32_t size) {
    // Through clamp first: the nearest texel centre on the page; NaN goes to the first.
    const float last = static_cast<float>(size) - 1.0f;
    const float position = std::min(std::max(0.0f, coordinate * static_cast<float>(size) - 0.5f), last);
    const auto first = static_cast<uint32_t>(position);
    return {first, std::min(first + 1, size - 1), position - static_cast<float>(first)};
}

// What the sampler returns: stored irradiance, and the three codes of the direction as unorm.
using Sample = std::array<float, 6>;

Sample decode(ColorFormat format, uint32_t irradiance, uint32_t direction) {
    const auto [r, g, b] = decodeColor(format, irradiance);
    constexpr float unorm = 1.0f / 1023.0f;
    return {r,
            g,
            b,
            static_cast<float>(direction & 0x3ff) * unorm,
            static_cast<float>(direction >> 10 & 0x3ff) * unorm,
            static_cast<float>(direction >> 20 & 0x3ff) * unorm};
}

Sample mix(const Sample& a, const Sample& b, float share_of_b) {
    Sample mixed;
    for (size_t i = 0; i < mixed.size(); ++i) mixed[i] = a[i] * (1.0f - share_of_b) + b[i] * share_of_b;
    return mixed;
}

}  // namespace

std::array<float, 3> sampleLightmap(const Pack& pack, std::span<const uint32_t> irradiance_pages,
                                    std::span<const uint32_t> direction_pages, uint32_t page, std::array<float, 2> uv,
                                    std::array<float, 3> normal_tangent) {
    const size_t texels = pack.data().base_pages.size();
    if (page >= pack.pageCount() || irradiance_pages.size() < texels || direction_pages.size() < texels) return {};
    const Tap x = tap(uv[0], pack.pageWidth()), y = tap(uv[1], pack.pageHeight());
    auto texel = [&](uint32_t tx, uint32_t ty) {
        const size_t i = (size_t{page} * pack.pageHeight() + ty) * pack.pageWidth() + tx;
        return decode(pack.colorFormat(), irradiance_pages[i], direction_pages[i]);
    };
    const Sample s = mix(mix(texel(x.first, y.first), texel(x.second, y.first), x.second_share),
                         mix(texel(x.first, y.second), texel(x.second, y.second), x.second_share), y.second_share);

    const float scale =
        falloff(pack.directionModel(), highlightFromUnorm(s[3], s[4], s[5]), normal_tangent) / pack.exposure();
    return {s[0] * scale, s[1] * scale, s[2] * scale};
}

}  // namespace dimmer
