#include "controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace dimmer::sample {
namespace {

constexpr float door_seconds = 1;

std::string textOf(const Weight& w) {
    return w.r == w.g && w.g == w.b ? fmt::format("{}", w.r) : fmt::format("{}/{}/{}", w.r, w.g, w.b);
}

}  // namespace

Controls::Controls(LightState& lights) : lights_(lights), last_(lights.pack().elements().size()) {}

// Cut off at the set's maximum.
Weight Controls::weightOf(uint32_t set, const Tint& tint) const {
    const float most = lights_.pack().elements()[set].max_weight;
    const auto channel = [&](float share) { return std::clamp(tint.brightness * share, 0.0f, most); };
    return {channel(tint.color.r), channel(tint.color.g), channel(tint.color.b)};
}

Tint Controls::tint(uint32_t set) {
    const Weight w = lights_.weight(LightSet{set});
    Tint& last = last_[set];
    if (weightOf(set, last) == w) return last;
    last.brightness = std::max({w.r, w.g, w.b});
    if (last.brightness > 0) last.color = {w.r / last.brightness, w.g / last.brightness, w.b / last.brightness};
    return last;
}

void Controls::setTint(uint32_t set, const Tint& tint) {
    last_[set] = tint;
    // Within its range, so that nothing can be refused but a set without records, which the sample has none of.
    (void)lights_.setWeight(LightSet{set}, weightOf(set, tint));
}

void Controls::setAll(bool on) {
    const auto elements = lights_.pack().elements();
    for (uint32_t i = 0; i < elements.size(); ++i)
        if (elements[i].kind == ElementKind::LightSet)
            (void)lights_.setWeight(LightSet{i}, on ? weightAtFirst(elements[i]) : 0);
}

void Controls::setOpen(uint32_t door, float open) {
    if (!std::isnan(open)) (void)lights_.setDoor(Door{door}, std::clamp(open, 0.0f, 1.0f));
}

float Controls::target(uint32_t door) const {
    const auto moving = std::ranges::find(moving_, door, &Moving::door);
    return moving == moving_.end() ? lights_.open(Door{door}) : moving->target;
}

void Controls::send(uint32_t door, float open) {
    std::erase_if(moving_, [&](const Moving& m) { return m.door == door; });
    moving_.push_back({door, std::clamp(open, 0.0f, 1.0f), lights_.open(Door{door})});
}

void Controls::step(float seconds) {
    std::erase_if(moving_, [&](Moving& m) {
        const float now = lights_.open(Door{m.door});
        if (now != m.last) return true;
        const float most = seconds / door_seconds;
        m.last = now + std::clamp(m.target - now, -most, most);
        (void)lights_.setDoor(Door{m.door}, m.last);
        return m.last == m.target;
    });
}

float weightAtFirst(const Element& element) {
    return element.kind == ElementKind::Door ? 0 : std::min(1.0f, element.max_weight);
}

Expected<void> resetWeights(LightState& lights) {
    const auto elements = lights.pack().elements();
    for (uint32_t i = 0; i < elements.size(); ++i) {
        const float weight = weightAtFirst(elements[i]);
        const bool is_door = elements[i].kind == ElementKind::Door;
        if (auto done = is_door ? lights.setDoor(Door{i}, weight) : lights.setWeight(LightSet{i}, weight); !done)
            return done;
    }
    return {};
}

std::string Controls::text() const {
    std::string text;
    const auto elements = lights_.pack().elements();
    for (uint32_t i = 0; i < elements.size(); ++i) {
        const bool door = elements[i].kind == ElementKind::Door;
        const Weight weight = door ? Weight(lights_.open(Door{i})) : lights_.weight(LightSet{i});
        text +=
            fmt::format("{}{}{}={}", text.empty() ? "" : ",", door ? "door:" : "", elements[i].name, textOf(weight));
    }
    return text;
}

}  // namespace dimmer::sample
