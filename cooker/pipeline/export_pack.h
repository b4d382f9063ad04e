// A pack as pictures and JSON, for engines that blend on their own.
#pragma once

#include <bake/progress.h>
#include <dimmer/pack.h>

#include <filesystem>

namespace dimmer::cook {

// Of index.json. A change that readers notice raises it.
inline constexpr uint32_t export_version = 1;

struct ExportStats {
    uint32_t files = 0;
    uint64_t bytes = 0;
};

// Writes into `folder` (created when missing) the base and every contribution as one OpenEXR picture per page that it
// touches, cropped to what it touches, and last index.json, which names them: while it is missing or old, so is the
// export. Channels R, G, B: irradiance on the texel's own normal, lux at weight 1; direction.r, .x, .y: how it falls
// off for other normals. How to blend them: docs/format.md.
Expected<ExportStats> exportPack(const Pack& pack, const std::filesystem::path& folder, Progress& progress);

}  // namespace dimmer::cook
