#include <dimmer/cpu_runtime.h>
#include <dimmer/door.h>
#include <dimmer/runtime.h>

#include <cstdio>
#include <limits>

// Links, and answers what every game must expect: that there is no such pack, and that NaN is no place.
int main() {
    const auto missing = dimmer::Pack::open("no such pack.dimmer");
    if (missing || missing.error().code != dimmer::ErrorCode::Io) return 1;
    std::printf("%s\n", missing.error().message.c_str());
    const auto pack = dimmer::Pack::open(GAME_PACK);
    if (!pack) return 1;
    dimmer::CpuRuntime lights(*pack);
    dimmer::Transform nowhere;
    nowhere.rows[0][3] = std::numeric_limits<float>::quiet_NaN();
    const auto refused = lights.addModel({}, nowhere);
    if (refused || refused.error().code != dimmer::ErrorCode::InvalidArgument) return 1;
    std::printf("%s\n", refused.error().message.c_str());
    const float no_angle = dimmer::hingedDoorWeight(std::numeric_limits<float>::quiet_NaN(), 1.5f);
    const auto door = lights.pack().elements().size() - 1;
    if (lights.setDoor(dimmer::Door{static_cast<uint32_t>(door)}, no_angle)) return 1;
    return 0;
}
