// Lamps that are near a texel, of which its few points do not tell how much light it gets.
#pragma once

#include <bake/gather.h>

namespace dimmer::cook {

// The mean of a lamp's light over a receiver's points, times this, is its mean over the receiver. The inverse square
// makes it uneven: over 25 cm of a floor 2 cm below a lamp, 8 points may find half of the light, or four times as much.
// All of it, for an even lamp in the open, is intensity times solid angle, which is known; the points say what share of
// it is shone there and what is in its way. 1 where the points' mean will do (4 points to 6 %), as from two texels'
// widths on, and where they do not stand for the whole texel: more than a fifth of it may lie in a wall. Thread-safe.
float nearLampScale(const Gatherer& gatherer, const GatherFrom& from, glm::vec3 lamp_m);

}  // namespace dimmer::cook
