// Irradiance by an independent path tracer, given beside the repository for levels that nobody here made.
#pragma once

#include <gtest/gtest.h>
#include <pipeline/light_error.h>
#include <pipeline/sample_points.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace dimmer::cook::test {

inline const std::filesystem::path truth_folder = std::filesystem::path(DIMMER_SOURCE_DIR) / "../shared/truth";
inline const std::filesystem::path levels_folder = std::filesystem::path(DIMMER_SOURCE_DIR) / "../shared/levels";

struct TruthPoint {
    QueryPoint place;
    double lux = 0, error_lux = 0;  // luminance; the error as if the channels erred together: its upper bound
};

// E.g. "two_rooms.surface.all_on"; empty when the file is absent.
inline std::vector<TruthPoint> readTruth(const std::string& name) {
    std::ifstream file(truth_folder / (name + ".csv"));
    std::vector<TruthPoint> out;
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
        std::ranges::replace(line, ',', ' ');
        std::istringstream numbers(line);
        std::array<double, 12> v{};
        for (double& x : v) numbers >> x;
        if (!numbers) ADD_FAILURE() << name << ": not twelve numbers: " << line;
        out.push_back({{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}},
                       0.2126 * v[6] + 0.7152 * v[7] + 0.0722 * v[8],
                       0.2126 * v[9] + 0.7152 * v[10] + 0.0722 * v[11]});
    }
    return out;
}

inline std::vector<QueryPoint> placesOf(const std::vector<TruthPoint>& truth) {
    std::vector<QueryPoint> out;
    for (const TruthPoint& t : truth) out.push_back(t.place);
    return out;
}

// floor = 1 % of the mean reference with all sets on.
inline double truthFloor(const std::vector<TruthPoint>& all_on) {
    double sum = 0;
    for (const TruthPoint& t : all_on) sum += t.lux;
    return floor_share * sum / static_cast<double>(all_on.size());
}

}  // namespace dimmer::cook::test
