// States ("hall=0.5,door:front=1") and the sample's scripts, against a pack that knows a few names.
#include <dimmer/cpu_runtime.h>
#include <fuzz/target.h>
#include <game_sample/timeline.h>
#include <pack/pack_data.h>
#include <update/state_text.h>

#include <cmath>

namespace dimmer::fuzz {
namespace {

const Pack& pack() {
    static const Pack made = [] {
        PackData data;
        data.page_width = data.page_height = 8;
        data.page_count = 1;
        data.base_pages.resize(64);
        data.elements = {
            {"hall", ElementKind::LightSet, 1}, {"alarm", ElementKind::LightSet, 2}, {"front", ElementKind::Door, 1}};
        data.viewpoints = {{"player_start", {0, 1, 0}, {0, 0, -1}, 1.0f}, {"upper floor", {4, 5, 6}, {0, 0, 1}, 0.9f}};
        return *Pack::fromData(std::move(data));
    }();
    return made;
}

std::vector<Weight> weightsOf(const LightState& state) {
    std::vector<Weight> weights;
    for (const Element& e : pack().elements())
        weights.push_back(e.kind == ElementKind::Door ? Weight(state.open(*state.door(e.name)))
                                                      : state.weight(*state.lightSet(e.name)));
    return weights;
}

void checkWeights(const LightState& state) {
    const auto weights = weightsOf(state);
    for (size_t i = 0; i < weights.size(); ++i)
        for (const float w : {weights[i].r, weights[i].g, weights[i].b})
            require(w >= 0 && w <= pack().elements()[i].max_weight, "weights stay in their range");
}

}  // namespace

void runState(Input input) {
    const std::string_view text = textOf(input);
    if (const auto parsed = parseState(text))
        for (const StateAssignment& a : *parsed)
            require(a.name.empty() || (a.name.data() >= text.data() && a.name.data() <= text.data() + text.size()),
                    "names are part of the text");
    static CpuRuntime runtime(pack());
    const auto before = weightsOf(runtime);
    const auto applied = runtime.apply(text);
    checkWeights(runtime);
    if (applied) return;
    require(!applied.error().message.empty(), "an error says something");
    require(weightsOf(runtime) == before, "a refused state changes nothing");
}

std::vector<Bytes> stateSeeds() {
    std::vector<Bytes> seeds;
    for (const char* text : {"hall=0.5,alarm=1/0.2/0.2,door:front=1", "all=0,hall=1", "alarm=2e0", "hal=1",
                             "door:front=-1", "hall=nan", "", "all=0.25/0/1,door:front=0.75"})
        seeds.push_back(bytesOf(text));
    return seeds;
}

void runScript(Input input) {
    const auto script = sample::parseScript(textOf(input), "fuzz.script", pack());
    if (!script) {
        require(script.error().message.starts_with("fuzz.script"), "an error names the file");
        return;
    }
    require(script->width > 0 && script->width <= sample::image_side_max && script->height > 0 &&
                script->height <= sample::image_side_max,
            "pictures have their limits");
    CpuRuntime runtime(pack());
    sample::Timeline timeline(*script);
    constexpr uint32_t frames_max = 64;  // enough for every kind of step to begin and end
    for (uint32_t frame = 0; frame < std::min(script->frames, frames_max); ++frame) {
        require(timeline.advance(frame, runtime).has_value(), "a script that parses also plays");
        checkWeights(runtime);
        const glm::vec3 p = timeline.camera().position_m;
        require(!std::isnan(p.x + p.y + p.z), "the camera is somewhere");
    }
}

std::vector<Bytes> scriptSeeds() {
    std::vector<Bytes> seeds;
    for (const char* text :
         {"size 320 200\nframes 17\nfps 25\nadapt 0.5\nsky 1 2 3.5\ncamera \"upper floor\"\n",
          "at 9 set hall=0.5  # late\nat 3 set all=0\n\n# only a comment\nat 3 set door:front=1\r\n",
          "at 1 fade hall 0 1 over 20\nat 2 fade alarm 0/0/0 2/1/0.5 over 9\nat 5 fade door:front 0 1 over 3\n",
          "at 0 flicker alarm 0.1 1 for 30 seed 7\nat 4 camera player_start\nat 6 move 1 2 3 look 0 0 0 fov 70 over "
          "8\n"})
        seeds.push_back(bytesOf(text));
    return seeds;
}

}  // namespace dimmer::fuzz
