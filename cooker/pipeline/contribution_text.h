// How tools name a contribution.
#pragma once

#include <pack/pack_data.h>

#include <string>
#include <vector>

namespace dimmer::cook {

// The light set's name, or "always".
std::string lightName(const PackData& pack, const Contribution& contribution);

std::vector<std::string> elementNames(const PackData& pack, const std::vector<uint32_t>& elements);

// For people: "hall", "always through door:front", "hall off closed door:den".
std::string describe(const PackData& pack, const Contribution& contribution);

}  // namespace dimmer::cook
