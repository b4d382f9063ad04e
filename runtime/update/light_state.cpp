#include <dimmer/light_state.h>

#include <fmt/format.h>
#include <probes/model_slots.h>
#include <update/planner.h>
#include <update/state_text.h>

#include <cmath>
#include <optional>

namespace dimmer {
namespace {

std::optional<uint32_t> findElement(std::span<const Element> elements, ElementKind kind, std::string_view name) {
    for (uint32_t i = 0; i < elements.size(); ++i)
        if (elements[i].kind == kind && elements[i].name == name) return i;
    return std::nullopt;
}

std::string_view kindName(ElementKind kind) {
    return kind == ElementKind::Door ? "door" : "light set";
}

Error unknownName(std::span<const Element> elements, ElementKind kind, std::string_view name) {
    std::vector<std::string_view> names;
    for (const Element& element : elements)
        if (element.kind == kind) names.push_back(element.name);
    const auto other = kind == ElementKind::Door ? ElementKind::LightSet : ElementKind::Door;
    std::string message = fmt::format("The pack has no {} \"{}\".", kindName(kind), name);
    if (names.empty())
        message += fmt::format(" It has no {} at all.", kindName(kind));
    else if (const auto nearest = nearestName(name, names); !nearest.empty())
        message += fmt::format(" Did you mean \"{}\"?", nearest);
    if (findElement(elements, other, name))
        message += fmt::format(" There is a {} of that name{}.", kindName(other),
                               other == ElementKind::Door ? fmt::format(": \"door:{}\" in a state", name) : "");
    return {ErrorCode::NotFound, std::move(message)};
}

Expected<uint32_t> lookUp(std::span<const Element> elements, ElementKind kind, std::string_view name) {
    if (const auto index = findElement(elements, kind, name)) return *index;
    return std::unexpected(unknownName(elements, kind, name));
}

Expected<void> checkHandle(std::span<const Element> elements, ElementKind kind, uint32_t index) {
    if (index < elements.size() && elements[index].kind == kind) return {};
    const std::string what =
        index == LightSet().element ? "A handle that was never looked up" : fmt::format("Element {}", index);
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} is no {} of this pack; handles come from a look-up on a runtime of the same pack.",
                            what, kindName(kind)));
}

bool inRange(float value, float max) {
    return value >= 0 && value <= max;
}  // false for NaN

Expected<void> checkWeight(const Element& set, const Weight& weight) {
    if (inRange(weight.r, set.max_weight) && inRange(weight.g, set.max_weight) && inRange(weight.b, set.max_weight))
        return {};
    return fail(ErrorCode::InvalidArgument,
                fmt::format("Light set \"{}\": the weight {}/{}/{} is not within 0..{}, the level's dimmer_max_weight.",
                            set.name, weight.r, weight.g, weight.b, set.max_weight));
}

Expected<void> checkOpen(const Element& door, float open) {
    if (inRange(open, 1)) return {};
    return fail(ErrorCode::InvalidArgument,
                fmt::format("Door \"{}\": {} is not within 0 (closed)..1 (open).", door.name, open));
}

// Adding 0 turns -0 into 0, so that equal weights have equal bits.
Weight normalised(const Weight& w) {
    return {w.r + 0.0f, w.g + 0.0f, w.b + 0.0f};
}

struct ElementChange {
    uint32_t element;
    Weight weight;
};

Expected<void> resolve(std::span<const Element> elements, const StateAssignment& assignment,
                       std::vector<ElementChange>& changes) {
    const bool is_door = assignment.target == StateAssignment::Target::Door;
    const auto index = lookUp(elements, is_door ? ElementKind::Door : ElementKind::LightSet, assignment.name);
    if (!index) return std::unexpected(index.error());
    const Element& element = elements[*index];
    if (auto ok = is_door ? checkOpen(element, assignment.value.r) : checkWeight(element, assignment.value); !ok)
        return ok;
    changes.push_back({*index, assignment.value});
    return {};
}

}  // namespace

Expected<LightSet> findLightSet(const Pack& pack, std::string_view name) {
    const auto index = lookUp(pack.elements(), ElementKind::LightSet, name);
    if (!index) return std::unexpected(index.error());
    return LightSet{*index};
}

Expected<Door> findDoor(const Pack& pack, std::string_view name) {
    const auto index = lookUp(pack.elements(), ElementKind::Door, name);
    if (!index) return std::unexpected(index.error());
    return Door{*index};
}

LightState::LightState(const Pack& pack, uint32_t page_sets, uint32_t moving_probes_max)
    : pack_(pack),
      models_(std::make_unique<ModelSlots>(pack.data(), moving_probes_max, page_sets)),
      held_(pack.elements().size()) {
    const PackData& data = pack_.data();
    const auto add = [&](const ReceiverView& receivers, std::vector<std::unique_ptr<Planner>>& planners) {
        const auto tables = std::make_shared<const PlanTables>(data, receivers);
        for (uint32_t i = 0; i < page_sets; ++i) planners.push_back(std::make_unique<Planner>(data, receivers, tables));
    };
    add(data.texelView(), planners_);
    if (!data.probes.payload.empty()) add(data.probes.view(), probe_planners_);
}
LightState::~LightState() = default;
LightState::LightState(LightState&&) noexcept = default;
LightState& LightState::operator=(LightState&&) noexcept = default;

void LightState::setElement(uint32_t element, Weight weight) {
    for (auto* planners : {&planners_, &probe_planners_})
        for (auto& planner : *planners) planner->setElement(element, normalised(weight));
}

Expected<void> LightState::checkHeld(uint32_t element, const Weight& weight) const {
    if (!held_[element] || weight == Weight(0)) return {};
    return fail(
        ErrorCode::InvalidArgument,
        fmt::format("Light set \"{}\": its records are not loaded, so its weight is held at 0; load them first.",
                    pack_.elements()[element].name));
}

Expected<void> LightState::checkSet(LightSet set) const {
    return checkHandle(pack_.elements(), ElementKind::LightSet, set.element);
}

void LightState::hold(LightSet set, bool held) {
    if (held) setElement(set.element, 0);
    held_[set.element] = held;
}

Expected<LightSet> LightState::lightSet(std::string_view name) const {
    return findLightSet(pack_, name);
}

Expected<Door> LightState::door(std::string_view name) const {
    return findDoor(pack_, name);
}

Expected<void> LightState::setWeight(LightSet set, Weight weight) {
    if (auto ok = checkHandle(pack_.elements(), ElementKind::LightSet, set.element); !ok) return ok;
    if (auto ok = checkWeight(pack_.elements()[set.element], weight); !ok) return ok;
    if (auto ok = checkHeld(set.element, weight); !ok) return ok;
    setElement(set.element, weight);
    return {};
}

Expected<void> LightState::setDoor(Door door, float open) {
    if (auto ok = checkHandle(pack_.elements(), ElementKind::Door, door.element); !ok) return ok;
    if (auto ok = checkOpen(pack_.elements()[door.element], open); !ok) return ok;
    setElement(door.element, Weight(open));
    return {};
}

Expected<void> LightState::apply(std::string_view state) {
    const auto assignments = parseState(state);
    if (!assignments) return std::unexpected(assignments.error());

    const auto elements = pack_.elements();
    std::vector<ElementChange> changes;
    for (const StateAssignment& assignment : *assignments) {
        if (assignment.target != StateAssignment::Target::AllSets) continue;
        for (uint32_t i = 0; i < elements.size(); ++i) {
            if (elements[i].kind != ElementKind::LightSet) continue;
            if (auto ok = checkWeight(elements[i], assignment.value); !ok) return ok;
            if (!held_[i]) changes.push_back({i, assignment.value});
        }
    }
    for (const StateAssignment& assignment : *assignments) {
        if (assignment.target == StateAssignment::Target::AllSets) continue;
        if (auto ok = resolve(elements, assignment, changes); !ok) return ok;
    }
    for (const ElementChange& change : changes)
        if (auto ok = checkHeld(change.element, change.weight); !ok) return ok;
    for (const ElementChange& change : changes) setElement(change.element, change.weight);
    return {};
}

Expected<void> LightState::setLimits(const UpdateLimits& limits) {
    if (!(limits.tolerance_quanta >= 0 && std::isfinite(limits.tolerance_quanta)))
        return fail(
            ErrorCode::InvalidArgument,
            fmt::format("A tolerance of {} quanta is neither 0 nor a positive number.", limits.tolerance_quanta));
    for (auto& planner : planners_) planner->prepareLimits(limits);
    for (auto& planner : planners_) planner->setLimits(limits);
    return {};
}

Expected<Model> LightState::addModel(const ModelGrid& grid, const Transform& transform) {
    return models_->add(grid, transform);
}
Expected<void> LightState::moveModel(Model model, const Transform& transform) {
    return models_->move(model, transform);
}
Expected<void> LightState::removeModel(Model model) {
    return models_->remove(model);
}
Expected<ModelSlot> LightState::modelSlot(Model model) const {
    return models_->slot(model);
}

// A handle of no such element has no weight; 0 is the harmless answer.
Weight LightState::weight(LightSet set) const {
    return checkHandle(pack_.elements(), ElementKind::LightSet, set.element) ? planner().element(set.element) : 0.0f;
}

float LightState::open(Door door) const {
    return checkHandle(pack_.elements(), ElementKind::Door, door.element) ? planner().element(door.element).r : 0.0f;
}

}  // namespace dimmer
