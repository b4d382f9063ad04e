// What opening a door does, against the reference path tracer.
#pragma once

#include <pipeline/verify.h>

namespace dimmer::cook {

// For each door that `state` leaves closed, with the others as they stand there: all light of the state, what is always
// on, and each light set alone that makes up a hundredth of what the door does, by the pack or by the reference. Places
// are drawn in proportion to what the pack says that the door does there, a tenth of them by how near the leaf they are
// alone, so that what a pack leaves out is found too, and count by the area that each stands for. The leaf itself does
// not count. A set's own light is told from pages that hold the always-on light as well, to a step of their format.
// Time grows with doors x (sets + 2).
Expected<std::vector<DoorReport>> verifyDoors(const Scene& scene, const Pack& pack, const VerifyOptions& options,
                                              const ReferenceState& state, Progress& progress);

}  // namespace dimmer::cook
