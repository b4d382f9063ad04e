// The default scene's nodes, placed in the world.
#pragma once

#include <scene/import_context.h>

#include <vector>

namespace dimmer::cook {

struct PlacedNode {
    int node = 0;
    int parent = -1;  // -1: a root
    glm::dmat4 world_from_node{1};
    // The node, itself or an ancestor, whose transform cannot be inverted; -1: none.
    int singular = -1;
};

// Parents before children, siblings in the file's order. Errors name nodes whose transform is malformed or not finite.
// checkModel must have passed.
Expected<std::vector<PlacedNode>> placeNodes(const ImportContext& context);

}  // namespace dimmer::cook
