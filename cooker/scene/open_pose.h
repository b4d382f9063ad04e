// Where the leaves of doors stand when they are open.
#pragma once

#include <scene/import_context.h>

namespace dimmer::cook {

// Errors name the node of a leaf that stands more than coordinate_max_m from the origin while its door is open, or is
// bent by its pose.
Expected<void> checkOpenPoses(const ImportContext& context);

// A leaf as it stands while its door is open. `closed` must belong to a door that opens by a pose.
SceneMesh inOpenPose(SceneMesh closed);

// Adds the open leaves of all doors that open by a pose, beside the closed ones.
void addOpenLeaves(Scene& scene);

}  // namespace dimmer::cook
