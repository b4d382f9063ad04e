#include <charts/bilinear.h>

#include <pack/pack_data.h>

#include <algorithm>

namespace dimmer::cook {

BilinearTaps::BilinearTaps(const Unwrap& unwrap, const Texels& texels)
    : unwrap_(unwrap), texels_(texels), shown_(texels.receiver_at.size(), no_index) {
    const auto at = [&](uint32_t address) -> uint32_t& {
        return shown_[unwrap.texelIndex(TexelAddress::page(address), TexelAddress::x(address),
                                        TexelAddress::y(address))];
    };
    for (uint32_t i = 0; i < texels.size(); ++i) at(texels.address[i]) = i;
    for (const FillTexel& fill : texels.fills) at(fill.address) = fill.source;
}

uint32_t BilinearTaps::shownAt(uint32_t page, glm::ivec2 texel) const {
    const glm::ivec2 size(unwrap_.page_width, unwrap_.page_height);
    const glm::uvec2 at(glm::clamp(texel, glm::ivec2(0), size - 1));  // as samplers do at a page's edge
    return shown_[unwrap_.texelIndex(page, at.x, at.y)];
}

void BilinearTaps::around(uint32_t receiver, std::vector<Tap>& taps) const {
    taps.assign(1, {receiver, 0});
    const uint32_t points = texels_.sampleCount(receiver), page = TexelAddress::page(texels_.address[receiver]);
    for (uint32_t i = 0; i < points; ++i) {
        const glm::vec2 place = placeOnPage(texels_, receiver, i) - 0.5f;
        const glm::ivec2 first(glm::floor(place));
        const glm::vec2 along = place - glm::vec2(first);
        for (const glm::ivec2 corner : {glm::ivec2(0, 0), {1, 0}, {0, 1}, {1, 1}}) {
            const glm::vec2 share = glm::mix(1.0f - along, along, glm::vec2(corner));
            uint32_t shown = shownAt(page, first + corner);
            if (shown == no_index || !framesAgree(shown, receiver)) shown = receiver;
            auto tap = std::ranges::find(taps, shown, &Tap::receiver);
            if (tap == taps.end()) tap = taps.insert(tap, {shown, 0});
            tap->weight += share.x * share.y / static_cast<float>(points);
        }
    }
}

bool BilinearTaps::framesAgree(uint32_t a, uint32_t b) const {
    return sameFrame(unwrap_.frames[texels_.face(a)], unwrap_.frames[texels_.face(b)]);
}

}  // namespace dimmer::cook
