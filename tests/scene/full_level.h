// A level with every kind of content, so that damage has something to hit.
#pragma once

#include <scene/level_file.h>

namespace dimmer::cook::test {

inline LevelFile fullLevel() {
    LevelFile level = LevelFile::withFloor();
    const int glow = level.addMaterial({{"name", "glow"}, {"emissiveFactor", {1, 1, 1}}});
    level.addNode(
        {{"name", "panel"}, {"mesh", level.addSquareMesh(glow)}, {"extras", {{"dimmer_light_set", "panels"}}}});
    level.addNode({{"name", "door"}, {"mesh", level.addSquareMesh(0)}, {"extras", {{"dimmer_door", "front"}}}});
    level.addLight("lamp", {{"type", "spot"}, {"spot", json::object()}, {"intensity", 5}},
                   {{"dimmer_light_set", "hall"}});
    level.document["scenes"][0]["extras"] = {
        {"dimmer_combinations", json::array({json::array({"door:front", "hall"})})},
        {"dimmer_sky_color", {1, 1, 1}},
        {"dimmer_sky_luminance", 10}};
    const uint16_t target = 1;
    const glm::vec3 value(2, 0, 0);
    level.document["accessors"][0]["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", level.addView(&target, sizeof(target))}, {"componentType", 5123}}},
        {"values", {{"bufferView", level.addView(&value, sizeof(value))}}}};
    return level;
}

}  // namespace dimmer::cook::test
