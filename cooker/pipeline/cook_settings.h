// What a cook is to do: a profile, with what the level and the command line say, as settings of the bake.
#pragma once

#include <bake/bake.h>
#include <pipeline/profile.h>
#include <scene/scene.h>

#include <string>
#include <vector>

namespace dimmer::cook {

// Whether this cook makes a global grid: as the profile says, and if it leaves that to the level, where something moves
// (a mesh that is dynamic, `dimmer_dynamic`) or players do (`dimmer_play_area`).
bool wantsGrid(const Profile& profile, const Scene& scene);

BakeSettings bakeSettings(const Profile& profile, const Quality& quality, const Scene& scene);

// The profile as this cook uses it: what it says, then the level's `dimmer_settings`, then "key=value" texts. Names of
// light sets that the level does not have are errors, but for a profile's own, which may be for other levels: they are
// dropped, and come back as warnings.
Expected<std::vector<std::string>> resolveSettings(Profile& profile, const Scene& scene,
                                                   const std::vector<std::string>& set);

}  // namespace dimmer::cook
