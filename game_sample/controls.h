// What a person does to the lights by hand, without any window in it.
#pragma once

#include <dimmer/light_state.h>

#include <string>
#include <vector>

namespace dimmer::sample {

// A light set's weight as a person thinks of it: brightness times colour.
struct Tint {
    float brightness = 0;
    Weight color{1};  // 0..1 each
};

class Controls {
   public:
    // `lights` must outlive the controls.
    explicit Controls(LightState& lights);

    // As the lights are: what was set here as it was set; else a colour with a channel of 1, or, of a set that is off,
    // the colour that it had last.
    Tint tint(uint32_t set);
    // What is beyond the set's maximum is cut off.
    void setTint(uint32_t set, const Tint& tint);

    // All sets at once.
    void setAll(bool on);

    // Clamped; NaN is passed by.
    void setOpen(uint32_t door, float open);
    // Where the door goes, or is.
    float target(uint32_t door) const;
    // The door goes there by itself, in a second from end to end, until somebody else moves it.
    void send(uint32_t door, float open);
    void step(float seconds);

    // What LightState::apply() takes to bring any runtime of the pack to the present state.
    std::string text() const;

   private:
    struct Moving {
        uint32_t door;
        float target, last;
    };

    Weight weightOf(uint32_t set, const Tint& tint) const;

    LightState& lights_;
    std::vector<Tint> last_;  // per element
    std::vector<Moving> moving_;
};

// What an element has at the beginning: a set 1 or its maximum, a door 0.
float weightAtFirst(const Element& element);
Expected<void> resetWeights(LightState& lights);

}  // namespace dimmer::sample
