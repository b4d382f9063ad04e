#include <dimmer/door.h>

#include <algorithm>
#include <cmath>

namespace dimmer {

float hingedDoorWeight(float angle_rad, float angle_max_rad) {
    constexpr float half_turn_rad = 3.14159265f;
    const float half_angle = 0.5f * std::min(std::abs(angle_rad), half_turn_rad);
    const float half_max = 0.5f * std::min(std::abs(angle_max_rad), half_turn_rad);
    if (half_max <= 0) return half_angle > 0 ? 1.0f : half_angle;
    // 1 - cos a = 2 sin^2(a / 2): cosines of small angles are 1 to the last bit.
    const float share = std::sin(half_angle) / std::sin(half_max);
    return std::min(share * share, 1.0f);  // in this order: std::min(1, NaN) would be 1
}

float slidingDoorWeight(float travel_m, float width_m) {
    if (std::isnan(travel_m) || std::isnan(width_m)) return travel_m + width_m;
    if (width_m == 0) return travel_m > 0 ? 1.0f : 0.0f;
    return std::clamp(travel_m / width_m + 0.0f, 0.0f, 1.0f);  // a sum, as -0 is within these too
}

}  // namespace dimmer
