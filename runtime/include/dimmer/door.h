// From how far a door stands open to the weight that LightState::setDoor takes: the share of the opening that light can
// pass. Defaults for the two common kinds; a game may use any curve of its own.
#pragma once

#include <algorithm>
#include <cmath>

namespace dimmer {

// A hinged leaf: the width that a leaf turned by `angle_rad` no longer covers, (1 - cos a) / (1 - cos a_max), clamped
// to 0..1. `angle_max_rad`: where the door counts as open, up to pi; at or below 0, every angle above 0 is open.
inline float hingedDoorWeight(float angle_rad, float angle_max_rad) {
    constexpr float half_turn_rad = 3.14159265f;
    const float angle = std::clamp(std::abs(angle_rad), 0.0f, half_turn_rad);
    if (!(angle_max_rad > 0)) return angle > 0 ? 1.0f : 0.0f;
    return std::min(1.0f, (1 - std::cos(angle)) / (1 - std::cos(std::min(angle_max_rad, half_turn_rad))));
}

// A sliding or lifting leaf: travel / width (height), clamped to 0..1. `width_m`: the travel at which it is open.
inline float slidingDoorWeight(float travel_m, float width_m) {
    if (!(width_m > 0)) return travel_m > 0 ? 1.0f : 0.0f;
    return std::clamp(travel_m / width_m, 0.0f, 1.0f);
}

}  // namespace dimmer
