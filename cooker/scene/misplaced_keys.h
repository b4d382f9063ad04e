// Keys that say something of what a node has not.
#pragma once

#include <scene/extras.h>

#include <string>

namespace dimmer::cook {

struct NodeContent {
    bool mesh = false, light = false;
    bool bakes_light = false;  // the keys that speak for its light say how it is baked
};

// Warns of what was ignored, with the mend. Errors for a `dimmer_bake` that is none.
Expected<void> warnOfMisplacedKeys(ImportContext& context, const Extras& extras, const std::string& owner,
                                   NodeContent content);

// Warns of a mesh's keys that are for another way to receive light than the stated one.
void warnOfOtherLightingsKeys(ImportContext& context, const Extras& extras, const std::string& owner,
                              Lighting lighting);

// Of a node that names no door: a pose belongs to the node that does.
void warnOfPoseWithoutDoor(ImportContext& context, const Extras& extras, const std::string& owner);

}  // namespace dimmer::cook
