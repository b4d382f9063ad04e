// The level's meshes as a pack holds them: with lightmap UVs, split by material and page.
#pragma once

#include <charts/unwrap.h>
#include <pack/pack_data.h>

namespace dimmer::cook {

std::vector<Mesh> levelMeshes(const RayScene& rays, const Unwrap& unwrap);

}  // namespace dimmer::cook
