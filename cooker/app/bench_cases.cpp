#include <app/bench_cases.h>

#include <fmt/format.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

bool isSet(const Element& element) {
    return element.kind == ElementKind::LightSet;
}

Expected<void> setElement(LightState& state, uint32_t index, float weight) {
    const Element& element = state.pack().elements()[index];
    const float in_range = std::min(weight, element.max_weight);
    return isSet(element) ? state.setWeight(LightSet{index}, in_range) : state.setDoor(Door{index}, in_range);
}

BenchCase toggle(const Pack& pack, uint32_t index) {
    const Element& element = pack.elements()[index];
    const float start = isSet(element) ? 1.0f : 0.0f;
    return {fmt::format("{} {} toggled", isSet(element) ? "set" : "door", element.name),
            [=](LightState& state, uint32_t frame) {
                return setElement(state, index, frame % 2 == 0 ? 1 - start : start);
            }};
}

// The first `count` sets go to half of the range they surely have and back, so that every frame changes all of them.
BenchCase changeSets(std::string name, uint32_t count) {
    return {std::move(name), [count](LightState& state, uint32_t frame) -> Expected<void> {
                for (uint32_t i = 0; i < count; ++i) {
                    const float full = std::min(1.0f, state.pack().elements()[i].max_weight);
                    if (auto ok = setElement(state, i, frame % 2 == 0 ? full / 2 : full); !ok) return ok;
                }
                return {};
            }};
}

// Five sets, spread over the list, at weights that differ from frame to frame.
BenchCase flicker(uint32_t sets) {
    return {"5 sets flicker", [sets](LightState& state, uint32_t frame) -> Expected<void> {
                constexpr uint32_t flickering = 5, steps = 97;
                for (uint32_t i = 0; i < flickering; ++i) {
                    const float weight = static_cast<float>((frame * 31 + i * 17 + 1) % steps) / steps;
                    if (auto ok = setElement(state, i * sets / flickering, weight); !ok) return ok;
                }
                return {};
            }};
}

}  // namespace

std::vector<BenchCase> casesOf(const Pack& pack) {
    std::vector<BenchCase> cases;
    cases.push_back({"nothing changed", [](LightState&, uint32_t) { return Expected<void>(); }});
    const auto elements = pack.elements();
    for (uint32_t i = 0; i < elements.size(); ++i) cases.push_back(toggle(pack, i));
    // Light sets come before doors.
    const auto sets = static_cast<uint32_t>(std::ranges::count_if(elements, isSet));
    for (uint32_t n = 2; n < sets; n *= 2) cases.push_back(changeSets(fmt::format("{} sets changed", n), n));
    if (sets >= 5) cases.push_back(flicker(sets));
    cases.push_back(changeSets("all sets changed", sets));
    return cases;
}

Expected<void> resetElements(LightState& state) {
    for (uint32_t i = 0; i < state.pack().elements().size(); ++i)
        if (auto ok = setElement(state, i, isSet(state.pack().elements()[i]) ? 1.0f : 0.0f); !ok) return ok;
    return {};
}

}  // namespace dimmer::cook
