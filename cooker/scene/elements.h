// The level's light sets, doors and combinations, gathered by name.
#pragma once

#include <scene/extras.h>
#include <scene/import_context.h>

#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace dimmer::cook {

class Elements {
   public:
    explicit Elements(ImportContext& context) : context_(context) {}

    // The light set that the extras name, which takes note of their maximum weight; empty when they name none.
    Expected<std::optional<uint32_t>> lightSet(const Extras& extras);

    // The door that the extras name; empty when they name none.
    Expected<std::optional<uint32_t>> door(const Extras& extras, const std::string& owner);

    // The open pose that a door's node states, as it would place something in that node's own axes; the identity when
    // it states none.
    Expected<glm::dmat4> openPose(const Extras& extras, const std::string& owner, uint32_t door);

    void doorHasGeometry(uint32_t door) { doors_[door].has_geometry = true; }
    // An error for the first door that nothing gave geometry to; warnings for poses that do nothing.
    Expected<void> checkDoors() const;

    // `dimmer_combinations`, after all elements are known.
    Expected<void> combinations(const Extras& scene_extras);

   private:
    struct DoorNotes {
        std::string owner;                   // the first node of that name
        std::string open_owner, pose_owner;  // who stated how it opens, and its open pose; empty: no one yet
        bool has_geometry = false;
    };
    Expected<void> readOpening(const Extras& extras, const std::string& owner, uint32_t door);
    Expected<ElementRef> named(const std::string& name) const;
    Expected<void> combination(std::span<const std::string> names);

    ImportContext& context_;
    std::unordered_map<std::string, uint32_t> set_of_name_, door_of_name_;
    std::vector<DoorNotes> doors_;
};

}  // namespace dimmer::cook
