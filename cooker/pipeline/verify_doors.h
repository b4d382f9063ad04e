// What opening a door does, against the reference path tracer.
#pragma once

#include <pipeline/verify.h>

namespace dimmer::cook {

// For each door that `state` leaves closed, with the others as they stand there: all light of the state, what is always
// on, and each light set alone where the door changes a thousandth of its light or more. Places are drawn in proportion
// to what the pack says that the door does there, a tenth of them evenly, and count by the area that each stands for:
// so the figures are of all surfaces, and what a pack leaves out is found too. The leaf itself does not count. Time
// grows with doors x (sets + 2).
Expected<std::vector<DoorReport>> verifyDoors(const Scene& scene, const Pack& pack, const VerifyOptions& options,
                                              const ReferenceState& state, Progress& progress);

}  // namespace dimmer::cook
