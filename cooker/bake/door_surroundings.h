// What a light group sends around each door, and how much of that the door changes: by these the faint light of its
// terms is told from what a player sees when the door moves.
#pragma once

#include <bake/door_paths.h>
#include <bake/sparse_light.h>
#include <bake/sums.h>

#include <algorithm>
#include <functional>
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
          changed_(light_),
          receivers_(paths.doorCount()) {}

    // Each receiver once, whether it has light or not.
    void addReceiver(size_t receiver) {
        for (const uint32_t door : doors_seen_.get().row(receiver)) ++receivers_.of[door];
    }

    void add(size_t receiver, uint32_t term, float lux) {
        const Term& t = paths_.get().terms()[term];
        for (const uint32_t door : doors_seen_.get().row(receiver)) {
            light_.of[at(door, t.group)] += static_cast<double>(lux);
            if (t.isAbout(door)) changed_.of[at(door, t.group)] += static_cast<double>(lux);
        }
    }

    DoorSurroundings& operator+=(const DoorSurroundings& o) {
        light_ += o.light_;
        changed_ += o.changed_;
        receivers_ += o.receivers_;
        return *this;
    }

    // All of the group's terms together, around that of the term's doors where they are faintest.
    float light(const Term& term) const { return leastMean(light_.of, term); }
    // The group's terms about the door, around that of the term's doors which changes least.
    float changed(const Term& term) const { return leastMean(changed_.of, term); }

   private:
    size_t at(uint32_t door, uint32_t group) const { return size_t{door} * paths_.get().groupCount() + group; }
    float leastMean(const std::vector<double>& sums, const Term& term) const {
        double least = std::numeric_limits<double>::infinity();
        for (const auto* doors : {&term.doors_open, &term.doors_closed})
            for (const uint32_t door : *doors)
                least = std::min(least, sums[at(door, term.group)] / std::max(receivers_.of[door], 1.0));
        return static_cast<float>(least);
    }

    std::reference_wrapper<const DoorPaths> paths_;
    std::reference_wrapper<const Sparse<uint32_t>> doors_seen_;
    Sums light_, changed_;  // door, group
    Sums receivers_;        // door
};

}  // namespace dimmer::cook
