// What the sample plays: a text file that a person can edit. One command per line; a word that begins with
// `#` starts a comment.
//
//     size WIDTH HEIGHT                            pixels; default 960 540
//     frames N                                     default: one second past the last step
//     fps N                                        default 30: how long a frame lasts for the eye's adaptation
//     adapt SECONDS                                default 1.2: time constant with which the eye adapts
//     sky R G B                                    cd/m2 behind everything; default 0 0 0
//     camera VIEW                                  where it begins
//     ball RADIUS X Y Z to X Y Z over FRAMES       metres: flies there and back as long as the script lasts
//     probes RADIUS                                the light probes of the level's grid as spheres, metres
//     at FRAME set STATE                           hall=0.5,alarm=1/0.2/0.2,door:front=1,all=0; may be in quotes
//     at FRAME fade NAME FROM TO over FRAMES       a light set, weights scalar or r/g/b, or door:NAME, 0..1
//     at FRAME flicker NAME LOW HIGH for FRAMES seed N    times the weight that the set has then, 0..1
//                                                  a later command about a set or door ends what runs there
//     at FRAME camera VIEW                         a cut: the eye has adapted to the new view
//     at FRAME move VIEW over FRAMES               a smooth move from the present view
//
// VIEW is the name of a camera in the level, or X Y Z look X Y Z [fov DEGREES] (metres; vertical field of view).
#pragma once

#include "camera.h"

#include <dimmer/light_state.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace dimmer::sample {

struct SetState {
    std::string state;
};
struct Fade {
    std::string element;  // a set's name, or "door:" and a door's name
    Weight from, to;
    uint32_t frames = 1;
};
struct Flicker {
    std::string set;
    float low = 0, high = 1;
    uint32_t frames = 1, seed = 0;
};
struct CameraCut {
    CameraPose view;
};
struct CameraMove {
    CameraPose view;
    uint32_t frames = 1;
};

struct Step {
    uint32_t frame = 0;
    uint32_t line = 0;  // of the file
    std::string text;   // as written, without "at FRAME"
    std::variant<SetState, Fade, Flicker, CameraCut, CameraMove> action;
};

// Something that moves, to be lit by the level's light grid.
struct Ball {
    float radius_m = 0;
    glm::vec3 from_m{}, to_m{};
    uint32_t frames = 1;  // one way
};

struct Script {
    uint32_t width = 960, height = 540;  // pixels
    uint32_t frames = 1;
    float fps = 30;
    float adaptation_s = 1.2f;
    glm::vec3 sky_cd_m2{0};
    CameraPose camera;
    std::vector<Ball> balls;
    float probe_radius_m = 0;  // 0: probes are not drawn
    std::vector<Step> steps;   // by frame; those of one frame in the order written
    std::vector<std::string> warnings;
};

inline constexpr uint32_t image_side_max = 8192;  // pixels; keeps a typing error from asking for a terabyte
inline constexpr uint32_t frame_count_max = 1'000'000;

// Names and weights are checked against the pack, so a script that parses also plays. Errors and warnings begin with
// `file`:line.
Expected<Script> parseScript(std::string_view text, std::string_view file, const Pack& pack);

}  // namespace dimmer::sample
