// The error that verify measured, as pictures of the lightmap's pages.
#pragma once

#include <pipeline/verify.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace dimmer::cook {

// Errors at and above this are drawn in the hottest colour; beyond, 25 % is 25 %.
inline constexpr double heat_full_error = 0.5;

// The name of a page's picture: "page_0.png".
std::string heatMapName(uint32_t page);
// Says beside them what the pictures are of: {"pack_id", "state", "pages"}.
inline constexpr const char* heat_map_index = "heat_maps.json";
// Of a picture, or the index.
bool isHeatMapName(std::string_view name);

// Writes page_0.png, page_1.png, ... into `folder` (created when missing): the pages' luminance in grey, and a disc in
// false colour per point: blue too dark, white exact, red too bright. Those of an earlier run go; the index is written
// last, with `pack_id` as reports have it.
Expected<void> writeHeatMaps(const std::filesystem::path& folder, const Pack& pack, const std::string& pack_id,
                             const VerifyReport& report, std::string_view state);

}  // namespace dimmer::cook
