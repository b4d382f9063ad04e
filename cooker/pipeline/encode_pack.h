// From a bake to what a pack holds.
#pragma once

#include <charts/texels.h>
#include <pipeline/charted_level.h>
#include <pipeline/cook.h>

namespace dimmer::cook {

// Of light that was multiplied by its sets' scales. Adds what there is to say of it to `stats`.
PackData encodePack(const ChartedLevel& level, const Texels& texels, const Baked& baked, const Profile& profile,
                    const std::string& quality, CookStats& stats);

}  // namespace dimmer::cook
