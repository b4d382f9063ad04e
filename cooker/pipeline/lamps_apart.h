// Light sets and always-on light taken apart for a bake, lamp by lamp, and put together afterwards: where a cache keeps
// what each lamp does, one that is edited alone is baked alone, and made brighter is multiplied.
#pragma once

#include <pipeline/set_scales.h>

#include <cstdint>
#include <vector>

namespace dimmer::cook {

struct LampGroups {
    std::vector<SceneLightSet> sets;                    // the level's own
    std::vector<std::vector<ElementRef>> combinations;  // likewise
    std::vector<uint32_t> whole;                        // per light group of the parts: the level's own
    bool none() const { return whole.empty(); }         // was taken apart
    uint32_t wholeOf(uint32_t group) const { return none() ? group : whole[group]; }

    // What is said of the level's groups, said of the parts.
    std::vector<float> ofParts(const std::vector<float>& of_groups) const;
};

// Makes every lamp of a set a set of its own, and all emissive surfaces of the set one more; sets of more than
// `lamps_max` of those stay whole. Likewise lamps of no set, of which the sky and surfaces stay always-on light.
LampGroups takeLampsApart(Scene& scene, uint32_t lamps_max);

// The sets again: the light of their parts, in lux, added up, with the records of all; `baked.door_flux`, whose use is
// the bake's, is dropped. `scales`: of the parts.
void putTogether(const LampGroups& parts, const SetScales& scales, Scene& scene, Baked& baked);

}  // namespace dimmer::cook
