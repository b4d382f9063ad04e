#include <pipeline/charted_level.h>

#include <charts/wall_cuts.h>
#include <pipeline/level_meshes.h>
#include <pipeline/prepare_scene.h>
#include <pipeline/profile.h>
#include <pipeline/set_scales.h>

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

Expected<std::unique_ptr<ChartedLevel>> chartAgain(const std::filesystem::path& level, const PackData& pack) {
    const auto settings = readSettings(pack.settings_json);
    if (!settings) return std::unexpected(settings.error());
    auto imported = importLevel(level);
    if (!imported) return std::unexpected(imported.error());
    auto charted = std::make_unique<ChartedLevel>();
    charted->scene = std::move(*imported);
    charted->copy_of = divideByScales(charted->scene).copy_of;
    prepareScene(charted->scene, settings->profile);
    cutAtWalls(charted->scene, settings->profile.texels_per_metre);
    charted->rays = std::make_unique<RayScene>(charted->scene);
    auto charts = unwrap(*charted->rays, {settings->profile.texels_per_metre, settings->profile.page_size});
    if (!charts) return std::unexpected(charts.error());
    charted->charts = std::move(*charts);
    if (!std::ranges::equal(levelMeshes(*charted->rays, charted->charts), pack.meshes, sameUvs))
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: its charts are not those of the pack: the level was changed since. Cook it again.",
                                level.string()));
    return charted;
}

}  // namespace dimmer::cook
