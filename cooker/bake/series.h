// The series expansion of the rendering equation over the lightmap itself: direct light once, then links between
// receivers traced once and followed bounce after bounce. What it leaves is the light that the final gather reads.
#pragma once

#include <bake/bake.h>
#include <bake/light_grid.h>

#include <string>
#include <vector>

namespace dimmer::cook {

// Whether light is stored of a term: always-on light over free paths is. Lit directly counts once it matters as much as
// the threshold asks of indirect light: a lamp without range lights everything in sight a little.
// `always_on_lux`: what is there of the group's light with all doors closed.
bool isActive(const TermReport& report, uint32_t term, float direct_lux, float bounced_lux, float always_on_lux);

struct Series {
    SparseLight direct;                   // irradiance from punctual lights, emitters and the sky, lux
    SparseLight bounced;                  // after one bounce or more, lux: over the texels around, where active
    SparseLight left_to_renderer;         // the part of `direct` that renderers draw themselves and no pack stores
    Sparse<ReceiverLight> stored_direct;  // the punctual part of `direct` that packs store
    SparseLight radiance;                 // what leaves each receiver, cd/m2; of what is faint, some for all
    Sparse<uint32_t> doors_seen;          // by the rays of each receiver, ascending
    std::vector<DoorIndices> doors_near;  // pairs of one another; see doorsNear() (bake/door_pairs.h)
    std::vector<TermReport> reports;      // per term
    std::vector<float> threshold_base;    // lux per term: what its threshold is a share of
    std::vector<uint32_t> group_of;       // per term: its light group, and the group's term over free paths
    std::vector<uint32_t> bounces;        // per light group
    uint64_t rays = 0;

    bool active(uint32_t term, float direct_lux, float bounced_lux, float always_on_lux) const {
        return isActive(reports[term], term, direct_lux, bounced_lux, always_on_lux);
    }
    // What the term is seen beside, where it is always-on light through doors; otherwise 0.
    float alwaysOnLux(size_t receiver, uint32_t term) const;
    // The largest threshold (BakeSettings) at which the term stays active at the receiver.
    float keepUpTo(size_t receiver, uint32_t term) const;
    // Ascending: always-on light over free paths, then what is active at the receiver.
    void activeTerms(size_t receiver, std::vector<uint32_t>& terms) const;
};

// Deterministic for any number of threads, and each light group's part is the same whichever others there are
// (combinations of doors, though, are the level's: see DoorPaths).
// Memory while it runs: series_rays receivers' numbers per texel, 2 to 3 bytes each. `lights`: of the level; may have
// more groups than are asked for. `groups`: per light group, whether to follow its light; empty: all. `links`: where
// the rays end, where that is known, to be filled in where it is empty; at least series_rays each.
Series expandSeries(const Gatherer& gatherer, const LightGrid& lights, const BakeSettings& settings, Progress& progress,
                    std::span<const uint8_t> groups = {}, RayEnds* links = nullptr);
// Only what arrives of each term, as TermReport::energy has it, lm. Rougher: of each texel one point sees each lamp.
std::vector<double> termFlux(const Gatherer& gatherer, const LightGrid& lights, const BakeSettings& settings,
                             Progress& progress, std::span<const uint8_t> groups = {}, RayEnds* links = nullptr);

}  // namespace dimmer::cook
