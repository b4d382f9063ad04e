// Direct light from punctual lights.
#pragma once

#include <bake/gather.h>
#include <bake/light_grid.h>
#include <bake/progress.h>

namespace dimmer::cook {

// Adds the direct light at a receiver, over every kept path through doors: to `reflected` from every baked light (it is
// what bounces), to `stored` from those with BakeMode::Full alone (a renderer draws the others itself). `grid` says
// which lights are worth asking; each is asked for from at most `points_max` of the receiver's points (but of
// GatherFrom::wide, lamps that are near, and narrow beams). Returns the shadow rays traced.
template <class Light>
uint64_t directLight(const Gatherer& gatherer, const LightGrid& grid, const GatherFrom& from,
                     TermAccumulator<Light>& reflected, TermAccumulator<Light>& stored,
                     uint32_t points_max = UINT32_MAX);

}  // namespace dimmer::cook
