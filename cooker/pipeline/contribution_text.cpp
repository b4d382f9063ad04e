#include <pipeline/contribution_text.h>

#include <fmt/format.h>

namespace dimmer::cook {

std::string lightName(const PackData& pack, const Contribution& contribution) {
    return contribution.light_set ? pack.elements[*contribution.light_set].name : "always";
}

std::vector<std::string> elementNames(const PackData& pack, const std::vector<uint32_t>& elements) {
    std::vector<std::string> names;
    for (const uint32_t element : elements) names.push_back(pack.elements[element].name);
    return names;
}

std::string describe(const PackData& pack, const Contribution& contribution) {
    std::string text = lightName(pack, contribution);
    for (const std::string& door : elementNames(pack, contribution.doors_open)) text += " through door:" + door;
    for (const std::string& door : elementNames(pack, contribution.doors_closed)) text += " off closed door:" + door;
    return text;
}

}  // namespace dimmer::cook
