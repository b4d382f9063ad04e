// A cook as one HTML file that needs no network: what costs what, and where on the pages.
#pragma once

#include <dimmer/pack.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace dimmer::cook {

struct ReportInput {
    std::string title;                                              // for the heading: the pack's file name
    uint64_t file_bytes = 0;                                        // 0: not known
    std::map<std::string, double> seconds;                          // per stage; empty: left out
    std::vector<std::pair<std::string, double>> bake_seconds = {};  // what of "bake" took how long
    std::vector<std::string> warnings;                              // of the cook
    nlohmann::json verify;                                          // what `verify --json` wrote; null: left out
    std::filesystem::path heat_maps;                                // the folder of `verify --heatmap`; empty: left out
};

// Pages are drawn at most so many texels wide and high; larger ones are thinned out.
inline constexpr uint32_t report_picture_max = 1024;

// Everything that comes from files is escaped. Time and size grow with (elements x texels of a page).
Expected<std::string> reportHtml(const Pack& pack, const ReportInput& input);

}  // namespace dimmer::cook
