// From how far a door stands open to the weight that LightState::setDoor takes: the share of the opening that light can
// pass. Defaults for the two common kinds; a game may use any curve of its own. Where an argument is NaN so is the
// weight, which setDoor refuses. Thread-safe. Not inline: under a game's -ffast-math, NaN would open doors.
#pragma once

namespace dimmer {

// A hinged leaf: the width that a leaf turned by `angle_rad` no longer covers, (1 - cos a) / (1 - cos a_max), clamped
// to 0..1. `angle_max_rad`: where the door counts as open, up to pi; at 0, every other angle is open. Signs do not
// count: leaves turn either way.
float hingedDoorWeight(float angle_rad, float angle_max_rad);

// A sliding or lifting leaf: travel / width (height), clamped to 0..1. `width_m`: the travel at which it is open, below
// 0 for a leaf that goes that way; at 0, all travel above 0 is open.
float slidingDoorWeight(float travel_m, float width_m);

}  // namespace dimmer
