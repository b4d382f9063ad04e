// Direct light from punctual lights.
#pragma once

#include <bake/gather.h>
#include <bake/light_grid.h>
#include <bake/progress.h>

namespace dimmer::cook {

// Adds the direct light at `receiver`: to `reflected` from every baked light (it is what bounces), to `stored` from
// those with BakeMode::Full alone (a renderer draws the others itself). `grid` says which lights are worth asking.
// Returns the shadow rays traced.
uint64_t directLight(const RayScene& rays, const LightGrid& grid, const Unwrap& unwrap, const Texels& texels,
                     size_t receiver, GroupAccumulator<Gathered>& reflected, GroupAccumulator<Gathered>& stored);

}  // namespace dimmer::cook
