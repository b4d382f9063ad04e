// Where there may be air that somebody moves through.
#pragma once

#include <probes/tetrahedra.h>
#include <trace/ray_scene.h>

namespace dimmer::cook {

// The box of what bakes, of all that moves and of the air over open ground: an open level may be no higher than a kerb.
// What is farther off than the level is long counts no more. Deterministic; costs some thousand rays.
Box airBox(const RayScene& rays);

}  // namespace dimmer::cook
