// Direct light from punctual lights.
#pragma once

#include <bake/gather.h>
#include <bake/light_grid.h>
#include <bake/progress.h>

namespace dimmer::cook {

// Adds the direct light at `receiver`, over every kept path through doors: to `reflected` from every baked light (it is
// what bounces), to `stored` from those with BakeMode::Full alone (a renderer draws the others itself). `grid` says
// which lights are worth asking. Returns the shadow rays traced.
uint64_t directLight(const Gatherer& gatherer, const LightGrid& grid, size_t receiver,
                     TermAccumulator<Gathered>& reflected, TermAccumulator<Gathered>& stored);

}  // namespace dimmer::cook
