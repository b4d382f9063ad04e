// A pack as pictures and JSON, for engines that blend on their own.
#pragma once

#include <bake/progress.h>
#include <dimmer/pack.h>

#include <filesystem>
#include <string_view>

namespace dimmer::cook {

// Of index.json. A change that readers notice raises it.
inline constexpr uint32_t export_version = 1;

struct ExportStats {
    uint32_t files = 0;
    uint64_t bytes = 0;
};

// Whether exportPack() may write, and remove, a file of that name.
bool isExportedName(std::string_view name);

// Removes from `folder` (created when missing) what earlier exports left, finished or not: every file whose name
// isExportedName() takes. Then writes the base and every contribution as one OpenEXR picture per page that it touches,
// cropped to what it touches, and last index.json, which names them: while it is missing, so is the export. Channels R,
// G, B: irradiance on the texel's own normal, lux at weight 1; direction.r, .x, .y: how it falls off for other normals.
// How to blend them: docs/format.md.
Expected<ExportStats> exportPack(const Pack& pack, const std::filesystem::path& folder, Progress& progress);

}  // namespace dimmer::cook
