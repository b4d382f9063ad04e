// The text form of a state, "hall=0.5,alarm=1/0.2/0.2,door:front=1", taken apart.
#pragma once

#include <dimmer/light_state.h>

#include <string_view>
#include <vector>

namespace dimmer {

struct StateAssignment {
    enum class Target { AllSets, Set, Door };
    Target target = Target::Set;
    std::string_view name;  // into the parsed text; without "door:"
    Weight value;
};

// Syntax only: names and ranges are the caller's to check. An empty text is no assignment.
Expected<std::vector<StateAssignment>> parseState(std::string_view text);

// Levenshtein's distance; capitals are no difference.
size_t editDistance(std::string_view a, std::string_view b);

// The name among `names` that was most likely meant, or empty when none is close.
std::string_view nearestName(std::string_view name, const std::vector<std::string_view>& names);

}  // namespace dimmer
