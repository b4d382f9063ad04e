// What a cook says of doors and light sets that do not do what their level may expect.
#pragma once

#include <bake/bake.h>
#include <pipeline/cook.h>
#include <scene/scene.h>

namespace dimmer::cook {

// Adds warnings to `stats`: of pairs of doors that lose light together, of sets and doors that change none by
// themselves; and the combinations that would help.
void warnOfElements(const Scene& scene, const Baked& baked, CookStats& stats);

}  // namespace dimmer::cook
