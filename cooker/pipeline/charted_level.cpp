#include <pipeline/charted_level.h>

#include <charts/wall_cuts.h>
#include <pipeline/level_meshes.h>
#include <pipeline/prepare_scene.h>

#include <fmt/format.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

bool sameUvs(const Mesh& a, const Mesh& b) {
    const auto same = [](const MeshVertex& v, const MeshVertex& w) {
        return v.position_m == w.position_m && v.lightmap_uv == w.lightmap_uv;
    };
    return a.node == b.node && a.page == b.page && a.indices == b.indices &&
           std::ranges::equal(a.vertices, b.vertices, same);
}

}  // namespace

ChartedLevel::ChartedLevel(Scene level, const Profile& profile) : scene(std::move(level)) {
    scales = divideByScales(scene);
    prepareScene(scene, profile);
}

Expected<void> ChartedLevel::chart(const Profile& profile) {
    cutAtWalls(scene, profile.texels_per_metre, profile.page_size);
    rays.emplace(scene);
    auto unwrapped = unwrap(*rays, unwrapOptions(profile));
    if (!unwrapped) return std::unexpected(unwrapped.error());
    charts = std::move(*unwrapped);
    return {};
}

UnwrapOptions unwrapOptions(const Profile& profile) {
    return {profile.texels_per_metre, profile.page_size};
}

Expected<std::unique_ptr<ChartedLevel>> chartAgain(Scene level, const PackData& pack) {
    const auto settings = readSettings(pack.settings_json);
    if (!settings) return std::unexpected(settings.error());
    auto charted = std::make_unique<ChartedLevel>(std::move(level), settings->profile);
    if (auto ok = charted->chart(settings->profile); !ok) return std::unexpected(ok.error());
    if (!std::ranges::equal(levelMeshes(*charted->rays, charted->charts), pack.meshes, sameUvs))
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: its charts are not those of the pack: the level was changed since. Cook it again.",
                                charted->scene.file));
    return charted;
}

Expected<std::unique_ptr<ChartedLevel>> chartAgain(const std::filesystem::path& level, const PackData& pack) {
    auto imported = importLevel(level);
    if (!imported) return std::unexpected(imported.error());
    return chartAgain(std::move(*imported), pack);
}

}  // namespace dimmer::cook
