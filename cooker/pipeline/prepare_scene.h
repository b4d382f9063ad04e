// From the level as it was imported to what is charted and baked.
#pragma once

#include <pipeline/profile.h>
#include <scene/scene.h>

namespace dimmer::cook {

// Adds the open leaves of doors, chooses how meshes are lit where the level leaves that open, and lists models. Walls
// cut faces later (charts/wall_cuts.h).
void prepareScene(Scene& scene, const Profile& profile);

}  // namespace dimmer::cook
