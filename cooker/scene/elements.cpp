#include <dimmer/pack.h>
#include <fmt/format.h>
#include <scene/combinations.h>
#include <scene/elements.h>

#include <algorithm>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <optional>

namespace dimmer::cook {

constexpr double rotation_length_max = 2;  // of a quaternion that was written by hand, as 0 1 0 1

namespace {

using NameLists = std::vector<std::vector<std::string>>;

// None where it is no list of lists of texts, nor the text of one: an editor's custom properties take no such lists.
std::optional<NameLists> namesOf(const tinygltf::Value& value) {
    if (value.IsString()) {
        const auto lists = nlohmann::json::parse(value.Get<std::string>(), nullptr, false);
        try {
            return lists.is_array() ? std::optional(lists.get<NameLists>()) : std::nullopt;
        } catch (const nlohmann::json::exception&) {
            return std::nullopt;
        }
    }
    if (!value.IsArray()) return std::nullopt;
    NameLists lists;
    for (const tinygltf::Value& list : value.Get<tinygltf::Value::Array>()) {
        if (!list.IsArray()) return std::nullopt;
        auto& names = lists.emplace_back();
        for (const tinygltf::Value& name : list.Get<tinygltf::Value::Array>()) {
            if (!name.IsString()) return std::nullopt;
            names.push_back(name.Get<std::string>());
        }
    }
    return lists;
}

}  // namespace

Expected<std::optional<uint32_t>> Elements::lightSet(const Extras& extras) {
    const auto name = extras.text("dimmer_light_set");
    if (!name) return std::unexpected(name.error());
    const auto stated = extras.positive("dimmer_max_weight", max_weight_limit);
    if (!stated) return std::unexpected(stated.error());
    if (!*name) return std::nullopt;
    const auto ok = checkElementName(context_, **name, "dimmer_light_set", extras.ownerOf("dimmer_light_set"));
    if (!ok) return std::unexpected(ok.error());
    const auto max_weight = static_cast<float>(stated->value_or(1.0));
    auto& sets = context_.scene.light_sets;
    const auto [set, is_new] = set_of_name_.try_emplace(**name, static_cast<uint32_t>(sets.size()));
    if (is_new) sets.push_back({**name, max_weight});
    sets[set->second].max_weight = std::max(sets[set->second].max_weight, max_weight);
    return set->second;
}

Expected<std::optional<uint32_t>> Elements::door(const Extras& extras, const std::string& owner) {
    const auto name = extras.text("dimmer_door");
    if (!name) return std::unexpected(name.error());
    if (!*name) return std::nullopt;
    if (const auto ok = checkElementName(context_, **name, "dimmer_door", extras.ownerOf("dimmer_door")); !ok)
        return std::unexpected(ok.error());
    auto& doors = context_.scene.doors;
    const auto [door, is_new] = door_of_name_.try_emplace(**name, static_cast<uint32_t>(doors.size()));
    if (is_new) {
        doors.emplace_back().name = **name;
        doors_.emplace_back().owner = owner;
    }
    if (const auto ok = readOpening(extras, owner, door->second); !ok) return std::unexpected(ok.error());
    return door->second;
}

Expected<void> Elements::readOpening(const Extras& extras, const std::string& owner, uint32_t index) {
    const auto opening = extras.choice("dimmer_door_open", {"remove", "pose"});
    if (!opening) return std::unexpected(opening.error());
    if (!*opening) return {};
    SceneDoor& door = context_.scene.doors[index];
    const bool pose = **opening == 1;
    std::string& stated_by = doors_[index].open_owner;
    if (!stated_by.empty() && door.pose != pose)
        return context_.error(
            owner, fmt::format("its 'dimmer_door_open' differs from that of {}, which is the same door '{}'. "
                               "Make them alike, or name two doors.",
                               stated_by, door.name));
    stated_by = owner;
    door.pose = pose;
    return {};
}

Expected<glm::dmat4> Elements::openPose(const Extras& extras, const std::string& owner, uint32_t index) {
    const auto rotation = extras.numbers("dimmer_door_rotation", 4);
    if (!rotation) return std::unexpected(rotation.error());
    const auto translation = extras.numbers("dimmer_door_translation", 3);
    if (!translation) return std::unexpected(translation.error());
    glm::dmat4 pose(1);
    if (*rotation) {
        const auto& q = **rotation;
        const glm::dquat quaternion(q[3], q[0], q[1], q[2]);  // w first
        if (!(glm::length(quaternion) > 1e-6))
            return context_.error(owner,
                                  "'dimmer_door_rotation' must be a quaternion x, y, z, w of length 1. Correct it.");
        if (glm::length(quaternion) > rotation_length_max)
            context_.warn(owner,
                          "'dimmer_door_rotation' is a quaternion x, y, z, w, of which the direction counts; its "
                          "numbers are larger than 1. If they are degrees, convert them.");
        pose = glm::mat4_cast(glm::normalize(quaternion));
    }
    if (*translation) pose[3] = {(**translation)[0], (**translation)[1], (**translation)[2], 1};
    if (pose != glm::dmat4(1)) doors_[index].pose_owner = owner;
    return pose;
}

Expected<void> Elements::checkDoors() const {
    for (size_t i = 0; i < doors_.size(); ++i) {
        const std::string& name = context_.scene.doors[i].name;
        if (!doors_[i].has_geometry)
            return context_.error(doors_[i].owner,
                                  fmt::format("the door '{}' has no geometry. Give it a mesh that is not "
                                              "dynamic, or remove 'dimmer_door'.",
                                              name));
        if (!doors_[i].pose_owner.empty() && !context_.scene.doors[i].pose)
            context_.warn(doors_[i].pose_owner,
                          fmt::format("the open pose of door '{}' was ignored, as it opens by 'remove'; "
                                      "set 'dimmer_door_open' to 'pose' to use it.",
                                      name));
        if (doors_[i].pose_owner.empty() && context_.scene.doors[i].pose)
            context_.warn(
                doors_[i].owner,
                fmt::format("the door '{}' opens by a pose, but states none that moves it: opening it changes nothing. "
                            "Give it 'dimmer_door_rotation' or 'dimmer_door_translation'.",
                            name));
    }
    return {};
}

Expected<ElementRef> Elements::named(const std::string& name) const {
    constexpr std::string_view door_prefix = "door:";
    const bool is_door = name.starts_with(door_prefix);
    const auto& known = is_door ? door_of_name_ : set_of_name_;
    const auto found = known.find(is_door ? name.substr(door_prefix.size()) : name);
    if (found != known.end()) return ElementRef{is_door, found->second};
    return context_.error("'dimmer_combinations'",
                          fmt::format("'{}' is no {} of this level. {}", name, is_door ? "door" : "light set",
                                      !is_door && door_of_name_.contains(name)
                                          ? fmt::format("There is a door of that name: write 'door:{}'.", name)
                                          : "Correct the name or remove it."));
}

Expected<void> Elements::combination(std::span<const std::string> names) {
    std::vector<ElementRef> combination;
    for (const std::string& name : names) {
        const auto element = named(name);
        if (!element) return std::unexpected(element.error());
        const auto same = [&](ElementRef other) {
            return other.is_door == element->is_door && other.index == element->index;
        };
        if (std::ranges::none_of(combination, same)) combination.push_back(*element);
    }
    if (std::ranges::count(combination, false, &ElementRef::is_door) > 1)
        return context_.error("'dimmer_combinations'",
                              "one combination names two light sets. The light of two sets simply "
                              "adds up: name at most one set with the doors.");
    const auto doors = std::ranges::count(combination, true, &ElementRef::is_door);
    if (doors > static_cast<std::ptrdiff_t>(combined_doors_max))
        return context_.error("'dimmer_combinations'",
                              fmt::format("one combination names {} doors, whose light is kept for every way in which "
                                          "each is open, closed or either; {} are the most. Name fewer, or several "
                                          "combinations of those that see one another.",
                                          doors, combined_doors_max));
    if (doors < 2)
        context_.warn(
            "'dimmer_combinations'",
            fmt::format("a combination names {}: light that asks for fewer than two doors is kept without one, "
                        "so that it does nothing. Name another door in it, or remove it.",
                        doors == 0 ? "no door" : "one door"));
    context_.scene.combinations.push_back(std::move(combination));
    return {};
}

Expected<void> Elements::combinations(const Extras& scene_extras) {
    const tinygltf::Value* stated = scene_extras.raw("dimmer_combinations");
    if (stated == nullptr) return {};
    const auto all = namesOf(*stated);
    if (!all) return context_.error("scene", "'dimmer_combinations' must be a list of lists of names. Correct it.");
    for (const auto& names : *all)
        if (const auto ok = combination(names); !ok) return ok;
    return {};
}

}  // namespace dimmer::cook
