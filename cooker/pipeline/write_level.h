// The level again, with the lightmap UVs that its pack uses: for engines that load their own meshes.
#pragma once

#include <pack/pack_data.h>

#include <filesystem>
#include <string>
#include <vector>

namespace dimmer::cook {

// Writes `level` to `out` as GLB. Nodes, materials, images, lights, cameras, extras and animations of nodes stay as
// they are; the geometry is the cooked one, cut where the cook cut it: POSITION, NORMAL, TEXCOORD_0 as the base colour
// wants it, and in TEXCOORD_1 the final UVs over the page that the mesh's extras name as "lightmap_page". A node whose
// charts lie on several pages gets a child for each further one. Both sides of a double-sided surface have texels of
// their own: they become two single-sided ones. Skins and morph targets are left out. `warnings` gets
// what was lost. `pack` must be what was cooked from the level.
Expected<void> writeLevel(const std::filesystem::path& level, const PackData& pack, const std::filesystem::path& out,
                          std::vector<std::string>& warnings);

}  // namespace dimmer::cook
