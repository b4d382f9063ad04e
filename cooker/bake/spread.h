// How numbers of many magnitudes are spread.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace dimmer::cook {

// By powers of two, from 0 on. Adds up in any grouping to the same counts.
class Spread {
   public:
    void add(double value) {
        const auto bin = static_cast<size_t>(std::clamp(std::ilogb(value), lowest, highest) - lowest);
        ++count_[bin];
        sum_[bin] += value;
    }
    Spread& operator+=(const Spread& o) {
        for (size_t b = 0; b < bins; ++b) count_[b] += o.count_[b], sum_[b] += o.sum_[b];
        return *this;
    }
    // Of the sum of all, what lies above so many times the median; to the power of two that the limit falls into.
    double sumAbove(double medians) const {
        double all = 0, below = 0, above = 0;
        for (const double count : count_) all += count;
        size_t middle = 0;
        while (middle + 1 < bins && 2 * (below + count_[middle]) < all) below += count_[middle++];
        const double limit = count_[middle] > 0 ? medians * sum_[middle] / count_[middle] : 0;
        if (!(limit > 0)) return 0;
        for (size_t b = middle; b < bins; ++b) above += std::max(0.0, sum_[b] - limit * count_[b]);
        return above;
    }

   private:
    static constexpr int lowest = -40, highest = 40;
    static constexpr size_t bins = highest - lowest + 1;
    std::array<double, bins> count_{}, sum_{};
};

}  // namespace dimmer::cook
