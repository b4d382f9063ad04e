#include <fmt/format.h>
#include <scene/misplaced_keys.h>

namespace dimmer::cook {

Expected<void> warnOfMisplacedKeys(ImportContext& context, const Extras& extras, const std::string& owner,
                                   NodeContent content) {
    const auto bake = extras.choice("dimmer_bake", {bake_modes.begin(), bake_modes.end()});
    if (!bake) return std::unexpected(bake.error());
    if (*bake && !content.bakes_light)
        context.warn(owner, "'dimmer_bake' is for lights and was ignored; what shines is baked whole.");
    if (extras.has("dimmer_max_weight") && !extras.has("dimmer_light_set"))
        context.warn(owner, "'dimmer_max_weight' without 'dimmer_light_set' was ignored.");
    if (content.mesh) return {};
    for (const char* key : {"dimmer_texel_density", "dimmer_grid_spacing"})
        if (extras.has(key))
            context.warn(owner,
                         fmt::format("'{}' is for meshes and was ignored; it does not count for what is below.", key));
    const auto lighting = extras.text("dimmer_lighting");
    if (!lighting) return std::unexpected(lighting.error());
    if (*lighting && (content.light || **lighting != "dynamic"))
        context.warn(owner, "'dimmer_lighting' is for meshes and was ignored; it does not count for what is below.");
    return {};
}

void warnOfOtherLightingsKeys(ImportContext& context, const Extras& extras, const std::string& owner,
                              Lighting lighting) {
    const auto warnUnless = [&](Lighting wanted, const char* key, const char* what) {
        if (lighting != Lighting::Automatic && lighting != wanted && extras.has(key))
            context.warn(owner, fmt::format("'{}' is for {} and was ignored.", key, what));
    };
    warnUnless(Lighting::Lightmap, "dimmer_texel_density", "meshes with a lightmap");
    warnUnless(Lighting::LocalGrid, "dimmer_grid_spacing", "meshes whose 'dimmer_lighting' is 'local_grid'");
}

void warnOfPoseWithoutDoor(ImportContext& context, const Extras& extras, const std::string& owner) {
    for (const char* key : {"dimmer_door_open", "dimmer_door_rotation", "dimmer_door_translation"})
        if (extras.has(key))
            context.warn(owner, fmt::format("'{}' was ignored, as {} names no door of its own; set 'dimmer_door' there "
                                            "too.",
                                            key, extras.ownerOf(key)));
}

}  // namespace dimmer::cook
