// A level as its pack has it: cut and charted by the settings of the cook.
#pragma once

#include <charts/unwrap.h>
#include <pack/pack_data.h>

#include <filesystem>
#include <memory>

namespace dimmer::cook {

struct ChartedLevel {
    Scene scene;                     // as it is baked: cut at walls, with open leaves, materials of sets copied
    std::vector<uint32_t> copy_of;   // see SetScales
    std::unique_ptr<RayScene> rays;  // over `scene`
    Unwrap charts;
};

// Charts `level` again with the settings that the pack carries. An error says so where that does not give the pack's
// own UVs: the level is another one, or was changed since.
Expected<std::unique_ptr<ChartedLevel>> chartAgain(const std::filesystem::path& level, const PackData& pack);

}  // namespace dimmer::cook
