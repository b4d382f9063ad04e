#include <cluster/texel_groups.h>

#include <pack/pack_data.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

uint64_t tileOrder(uint32_t address) {
    const uint64_t x = TexelAddress::x(address), y = TexelAddress::y(address);
    return uint64_t{TexelAddress::page(address)} << 32 | (y >> 3) << 20 | (x >> 3) << 8 | (y & 7) << 3 | (x & 7);
}

}  // namespace

std::vector<ShownTexel> listTexels(const Texels& texels) {
    std::vector<ShownTexel> shown;
    shown.reserve(texels.size() + texels.fills.size());
    for (uint32_t i = 0; i < texels.size(); ++i) shown.push_back({tileOrder(texels.address[i]), texels.address[i], i});
    for (const FillTexel& f : texels.fills) shown.push_back({tileOrder(f.address), f.address, f.source});
    std::ranges::sort(shown, {}, &ShownTexel::order);
    return shown;
}

std::vector<Group> groupTexels(std::span<const ShownTexel> texels,
                               const std::function<std::vector<uint32_t>(uint32_t receiver)>& listOf,
                               uint32_t overlap_max) {
    Grouping grouping;
    std::vector<uint64_t> tiles;
    tiles.reserve(texels.size());
    for (uint32_t t = 0; t < texels.size(); ++t) {
        grouping.add(t, TexelAddress::page(texels[t].address), listOf(texels[t].source));
        tiles.push_back(texels[t].order >> 8);
    }
    return mergeGroups(std::move(grouping).groups(), tiles, texel_group_bytes, overlap_max);
}

}  // namespace dimmer::cook
