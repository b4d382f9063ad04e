// Lightmap UVs that a level brings.
#pragma once

#include <scene/scene.h>

namespace dimmer::cook {

// Empties SceneMesh::uv1 where it is no unwrap (inside 0..1, every triangle with area, no two on one spot) and says why
// in uv1_fault. Only of meshes that get a lightmap.
void dropInvalidUnwraps(Scene& scene);

}  // namespace dimmer::cook
