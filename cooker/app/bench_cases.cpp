#include <app/bench_cases.h>

#include <fmt/format.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <memory>

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
    return {
        fmt::format("{} {} toggled", isSet(element) ? "set" : "door", element.name),
        [=](LightState& state, uint32_t frame) { return setElement(state, index, frame % 2 == 0 ? 1 - start : start); },
        isSet(element) ? 1u : 0u};
}

// The first `count` sets go to half of the range they surely have and back, so that every frame changes all of them.
BenchCase changeSets(std::string name, uint32_t count) {
    return {std::move(name),
            [count](LightState& state, uint32_t frame) -> Expected<void> {
                for (uint32_t i = 0; i < count; ++i) {
                    const float full = std::min(1.0f, state.pack().elements()[i].max_weight);
                    if (auto ok = setElement(state, i, frame % 2 == 0 ? full / 2 : full); !ok) return ok;
                }
                return {};
            },
            count};
}

// Five sets, spread over the list, at weights that differ from frame to frame.
BenchCase flicker(uint32_t sets) {
    return {"5 sets flicker",
            [sets](LightState& state, uint32_t frame) -> Expected<void> {
                constexpr uint32_t flickering = 5, steps = 97;
                for (uint32_t i = 0; i < flickering; ++i) {
                    const float weight = static_cast<float>((frame * 31 + i * 17 + 1) % steps) / steps;
                    if (auto ok = setElement(state, i * sets / flickering, weight); !ok) return ok;
                }
                return {};
            },
            0};
}

// Models of 4 x 4 x 4 probes, each a step further every frame, from places spread over the grid's box.
BenchCase moveModels(const Pack& pack) {
    auto models = std::make_shared<std::vector<Model>>();
    const StartGrid box = pack.data().probes.global.start;
    return {fmt::format("{} models moved", bench_models),
            [=](LightState& state, uint32_t frame) -> Expected<void> {
                for (uint32_t i = 0; i < bench_models; ++i) {
                    Transform place;
                    for (size_t axis = 0; axis < 3; ++axis) {
                        const uint32_t strides[] = {37, 11, 53};
                        const auto step = static_cast<float>((i * strides[axis] + frame / 8) % bench_models);
                        const float share = (step + static_cast<float>(frame % 8) / 8) / bench_models;
                        place.rows[axis][3] = box.min_m[axis] + share * (box.max_m[axis] - box.min_m[axis]);
                    }
                    if (frame > 0) {
                        if (auto ok = state.moveModel((*models)[i], place); !ok) return ok;
                        continue;
                    }
                    const auto model = state.addModel({{-1, -1, -1}, {1, 1, 1}, {4, 4, 4}}, place);
                    if (!model) return std::unexpected(model.error());
                    models->push_back(*model);
                }
                return {};
            },
            0};
}

}  // namespace

std::vector<BenchCase> casesOf(const Pack& pack) {
    std::vector<BenchCase> cases;
    cases.push_back({"nothing changed", [](LightState&, uint32_t) { return Expected<void>(); }, 0});
    const auto elements = pack.elements();
    for (uint32_t i = 0; i < elements.size(); ++i) cases.push_back(toggle(pack, i));
    // Light sets come before doors.
    const auto sets = static_cast<uint32_t>(std::ranges::count_if(elements, isSet));
    for (uint32_t n = 2; n < sets; n *= 2) cases.push_back(changeSets(fmt::format("{} sets changed", n), n));
    if (sets >= 5) cases.push_back(flicker(sets));
    cases.push_back(changeSets("all sets changed", sets));
    if (!pack.data().probes.global.empty()) cases.push_back(moveModels(pack));
    return cases;
}

Expected<void> resetElements(LightState& state) {
    for (uint32_t i = 0; i < state.pack().elements().size(); ++i)
        if (auto ok = setElement(state, i, isSet(state.pack().elements()[i]) ? 1.0f : 0.0f); !ok) return ok;
    return {};
}

}  // namespace dimmer::cook
