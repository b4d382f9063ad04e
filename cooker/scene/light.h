// KHR_lights_punctual and cameras, placed in the world.
#pragma once

#include <scene/import_context.h>

namespace dimmer::cook {

// The light of index `light`, as `node` places it. Node name, bake mode and light set are left at their
// defaults.
Expected<PunctualLight> importLight(const ImportContext& context, int light, int node,
                                    const glm::dmat4& world_from_node);

// Where a camera or the node "player_start" looks. `camera` is empty for a node without one.
Expected<SceneViewpoint> importViewpoint(const ImportContext& context, std::optional<int> camera, int node,
                                         const glm::dmat4& world_from_node);

}  // namespace dimmer::cook
