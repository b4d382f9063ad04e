// A change of settings that makes a pack smaller, and what it costs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// A setting to change.
struct Change {
    std::string key;
    float from = 0, to = 0;
    bool operator==(const Change&) const = default;
};

struct Remedy {
    std::vector<Change> changes;
    bool fits = false;
    uint64_t saves = 0;  // bytes of records, pages and grids on the device; not the work lists that go with them
    double error = 0;    // mean relative error that it adds, all sets at weight 1; see LossTable
    double energy = 0;   // of what loses most, the share of its stored light, by luminous flux at texels
    std::string energy_of = {};             // a set, or always-on light through doors
    bool moves_light = false;               // the light of what moves gets coarser
    std::optional<double> grid_error = {};  // by so much in the mean, where that is known; see LossTable::probesError
    bool texels = true;                     // that of lightmaps changes, by `error`

    // For people, with the note behind it. Of many changes the first few, and all of them as options on a line below.
    std::string text(std::string_view note = {}) const;
    // "--set a=1 --set b=2", as a shell reads it.
    std::string options() const;

   private:
    std::string modelsText() const;
};

// Without those beside which another changes less and is no worse in anything that is said of it.
std::vector<Remedy> withoutDominated(std::vector<Remedy> found);

// Of those that change the same kinds of settings (thresholds, density, probes), the one that saves most.
std::vector<Remedy> bestOfEachKind(const std::vector<Remedy>& found);

}  // namespace dimmer::cook
