// Cuts faces where thin walls stand on them.
#pragma once

#include <scene/scene.h>

namespace dimmer::cook {

// A floor that runs on under a wall into the next room would share texels between the rooms, and bilinear filtering
// would leak light through the wall. Where a wall (or a closed door) thinner than the filter's reach, or a single skin,
// stands on a plane of the level (charts/standing_walls.h), the triangles of that plane are cut along the wall's
// middle, and SceneMesh::triangle_regions tells the two sides apart. Walls count in whatever direction they stand, if
// they are a few texels long (charts/wall_parts.h). Positions, normals and UVs are interpolated: the surface stays the
// same, and closed, as triangles beside a cut are split where it ends (charts/shared_edges.h), but for those of leaves
// and of meshes that stay whole. Those are the ones that bring an unwrap; one that is none is dropped before
// (charts/file_uv.h), and its mesh cut like any other. What does not fit a page of `page_size` texels a side has larger
// texels, which reach farther. Not to be called twice.
void cutAtWalls(Scene& scene, float texels_per_metre, uint32_t page_size = 4096);

}  // namespace dimmer::cook
