// A level cut and charted by the settings of a cook.
#pragma once

#include <charts/unwrap.h>
#include <pack/pack_data.h>
#include <pipeline/profile.h>
#include <pipeline/set_scales.h>

#include <filesystem>
#include <memory>
#include <optional>

namespace dimmer::cook {

struct ChartedLevel {
    // As imported: divides light by its groups' scales and prepares the scene (prepareScene). The rest waits for
    // chart().
    ChartedLevel(Scene level, const Profile& profile);
    ChartedLevel(const ChartedLevel&) = delete;  // `rays` refers to `scene`
    ChartedLevel& operator=(const ChartedLevel&) = delete;

    // Cuts faces at walls, and makes `rays` and `charts`.
    Expected<void> chart(const Profile& profile);

    Scene scene;  // as it is baked: cut at walls, with open leaves, materials of sets copied
    SetScales scales;
    std::optional<RayScene> rays;  // over `scene`
    Unwrap charts;
};

UnwrapOptions unwrapOptions(const Profile& profile);

// Charts a level again with the settings that the pack carries. An error says so where that does not give the pack's
// own UVs: the level is another one, or was changed since.
Expected<std::unique_ptr<ChartedLevel>> chartAgain(Scene level, const PackData& pack);
Expected<std::unique_ptr<ChartedLevel>> chartAgain(const std::filesystem::path& level, const PackData& pack);

}  // namespace dimmer::cook
