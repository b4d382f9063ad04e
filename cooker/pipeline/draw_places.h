// Places drawn where there is something to measure, that still speak for all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// Indices, ascending, each once, and how many candidates each stands for: the sum of weight * f over them estimates the
// sum of f over all candidates without bias, whatever f is, where the density is not 0.
struct DrawnPlaces {
    std::vector<size_t> index;
    std::vector<double> weight;
};

// `count` draws at equal steps through the cumulated density, with one random shift; those of one candidate are one.
DrawnPlaces drawPlaces(std::span<const double> density, uint32_t count, uint32_t seed);

}  // namespace dimmer::cook
