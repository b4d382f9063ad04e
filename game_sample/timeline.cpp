#include "timeline.h"

#include <update/state_text.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace dimmer::sample {
namespace {

constexpr std::string_view door_prefix = "door:";

Weight mix(const Weight& a, const Weight& b, float t) {
    // std::lerp: exactly `b` at 1 and never beyond it, so no weight leaves its range by rounding.
    return {std::lerp(a.r, b.r, t), std::lerp(a.g, b.g, t), std::lerp(a.b, b.b, t)};
}

Expected<void> setElement(LightState& lights, std::string_view element, const Weight& weight) {
    if (element.starts_with(door_prefix)) {
        const auto door = lights.door(element.substr(door_prefix.size()));
        return door ? lights.setDoor(*door, weight.r) : std::unexpected(door.error());
    }
    const auto set = lights.lightSet(element);
    return set ? lights.setWeight(*set, weight) : std::unexpected(set.error());
}

// 0 at the step's first frame, 1 at its last and after.
float progress(uint32_t frame, uint32_t first, uint32_t frames) {
    return frame - first >= frames ? 1.0f : static_cast<float>(frame - first) / static_cast<float>(frames);
}

// What a fade or a flicker is about; empty for what does not last, and for moves.
std::string_view elementOf(const Step& step) {
    if (const auto* fade = std::get_if<Fade>(&step.action)) return fade->element;
    if (const auto* flicker = std::get_if<Flicker>(&step.action)) return flicker->set;
    return {};
}

// What a state names, "all" being every set; checked when the script was read.
bool names(std::string_view state, std::string_view element) {
    const auto assignments = parseState(state);
    if (!assignments) return false;
    const bool is_door = element.starts_with(door_prefix);
    if (is_door) element.remove_prefix(door_prefix.size());
    return std::ranges::any_of(*assignments, [&](const StateAssignment& a) {
        if (a.target == StateAssignment::Target::AllSets) return !is_door;
        return is_door == (a.target == StateAssignment::Target::Door) && a.name == element;
    });
}

// A later step about the same set or door: the earlier one would go on writing over it.
bool ends(const Step& later, const Step& running) {
    const std::string_view element = elementOf(running);
    if (element.empty()) return false;
    const auto* set = std::get_if<SetState>(&later.action);
    return set ? names(set->state, element) : elementOf(later) == element;
}

bool touchesLights(const Step& step) {
    return !std::holds_alternative<CameraCut>(step.action) && !std::holds_alternative<CameraMove>(step.action);
}

}  // namespace

float flickerNoise(uint32_t seed, uint32_t frame) {
    // PCG hash (Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020), twice.
    const auto hash = [](uint32_t value) {
        const uint32_t state = value * 747796405u + 2891336453u;
        const uint32_t word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737u;
        return (word >> 22) ^ word;
    };
    return static_cast<float>(hash(hash(seed) + frame) >> 8) * 0x1p-24f;
}

Expected<std::vector<std::string>> Timeline::advance(uint32_t frame, LightState& lights) {
    cut_ = false;
    std::vector<std::string> done;
    for (; next_step_ < script_.steps.size() && script_.steps[next_step_].frame <= frame; ++next_step_) {
        const Step& step = script_.steps[next_step_];
        if (auto begun = begin(step, lights); !begun) return std::unexpected(begun.error());
        if (std::holds_alternative<SetState>(step.action)) done.push_back(step.text);
    }
    std::vector<Running> still_running;
    for (const Running& running : running_) {
        const auto more = run(running, frame, lights);
        if (!more) return std::unexpected(more.error());
        if (touchesLights(*running.step)) done.push_back(running.step->text);
        if (*more) still_running.push_back(running);
    }
    running_ = std::move(still_running);
    return done;
}

Expected<void> Timeline::begin(const Step& step, LightState& lights) {
    std::optional<Weight> flickered;  // the weight that a flicker which ends here would have given back
    std::erase_if(running_, [&](const Running& r) {
        const bool ended = ends(step, *r.step);
        if (ended && std::holds_alternative<Flicker>(r.step->action)) flickered = r.start_weight;
        return ended;
    });
    if (const auto* set = std::get_if<SetState>(&step.action)) return lights.apply(set->state);
    if (const auto* camera = std::get_if<CameraCut>(&step.action)) {
        std::erase_if(running_, [](const Running& r) { return std::holds_alternative<CameraMove>(r.step->action); });
        camera_ = camera->view;
        cut_ = true;
        return {};
    }
    Running running{&step, {}, camera_};
    if (const auto* flicker = std::get_if<Flicker>(&step.action)) {
        const auto set = lights.lightSet(flicker->set);
        if (!set) return std::unexpected(set.error());
        running.start_weight = flickered.value_or(lights.weight(*set));
    }
    running_.push_back(running);
    return {};
}

// False when the step has come to its end.
Expected<bool> Timeline::run(const Running& running, uint32_t frame, LightState& lights) {
    const uint32_t first = running.step->frame;
    const auto outcome = [](const Expected<void>& set, bool more) -> Expected<bool> {
        if (!set) return std::unexpected(set.error());
        return more;
    };
    if (const auto* fade = std::get_if<Fade>(&running.step->action)) {
        const float t = progress(frame, first, fade->frames);
        return outcome(setElement(lights, fade->element, mix(fade->from, fade->to, t)), t < 1);
    }
    if (const auto* flicker = std::get_if<Flicker>(&running.step->action)) {
        const bool more = frame - first < flicker->frames;
        const float scale =
            more ? flicker->low + (flicker->high - flicker->low) * flickerNoise(flicker->seed, frame) : 1.0f;
        return outcome(setElement(lights, flicker->set, mix(0.0f, running.start_weight, scale)), more);
    }
    const auto& move = std::get<CameraMove>(running.step->action);
    const float t = progress(frame, first, move.frames);
    camera_ = blend(running.start_view, move.view, t);
    return t < 1;
}

}  // namespace dimmer::sample
