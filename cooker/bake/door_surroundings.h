// What a light group sends around each door, and how much of that the door changes: by these the faint light of its
// terms is told from what a player sees when the door moves.
#pragma once

#include <bake/door_paths.h>
#include <bake/sparse_light.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace dimmer::cook {

// Means over the receivers that see a door, per light group, of luminances in lux.
class DoorSurroundings {
   public:
    // `doors_seen`: per receiver, ascending; it is kept by reference.
    DoorSurroundings(const DoorPaths& paths, const Sparse<uint32_t>& doors_seen)
        : paths_(paths),
          doors_seen_(doors_seen),
          light_(size_t{paths.doorCount()} * paths.groupCount()),
          changed_(light_.size()),
          receivers_(paths.doorCount()) {
        for (size_t i = 0; i < doors_seen.rows(); ++i)
            for (const uint32_t door : doors_seen.row(i)) ++receivers_[door];
    }

    void add(size_t receiver, uint32_t term, float lux) {
        const Term& t = paths_.terms()[term];
        for (const uint32_t door : doors_seen_.row(receiver)) {
            light_[at(door, t.group)] += static_cast<double>(lux);
            if (t.isAbout(door)) changed_[at(door, t.group)] += static_cast<double>(lux);
        }
    }

    // All of the group's terms together, around that of the term's doors where they are faintest.
    float light(const Term& term) const { return leastMean(light_, term); }
    // The group's terms about the door, around that of the term's doors which changes least.
    float changed(const Term& term) const { return leastMean(changed_, term); }

   private:
    size_t at(uint32_t door, uint32_t group) const { return size_t{door} * paths_.groupCount() + group; }
    float leastMean(const std::vector<double>& sums, const Term& term) const {
        double least = std::numeric_limits<double>::infinity();
        for (const auto* doors : {&term.doors_open, &term.doors_closed})
            for (const uint32_t door : *doors)
                least = std::min(least, sums[at(door, term.group)] / std::max(receivers_[door], 1.0));
        return static_cast<float>(least);
    }

    const DoorPaths& paths_;
    const Sparse<uint32_t>& doors_seen_;
    std::vector<double> light_, changed_;  // door, group
    std::vector<double> receivers_;        // door
};

}  // namespace dimmer::cook
