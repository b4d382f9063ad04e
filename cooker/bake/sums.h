// Sums over many rows of light, in parallel.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

namespace dimmer::cook {

// The sum of sumOf(begin, end) over all of `rows`, in parallel. Which rows are added up together depends on their
// number alone, so that the sum is the same to the bit for any number of threads. Sum: has += and a value of no rows,
// `none`.
template <class Sum>
Sum sumOverRows(size_t rows, const Sum& none, auto&& sumOf) {
    constexpr size_t parts = 64;
    const size_t grain = rows / parts + 1;
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<size_t>(0, rows, grain), none,
        [&](const tbb::blocked_range<size_t>& r, Sum sum) {
            sumOf(r.begin(), r.end(), sum);
            return sum;
        },
        [](Sum a, const Sum& b) {
            a += b;
            return a;
        });
}

// Numbers that add up one by one.
struct Sums {
    explicit Sums(size_t count = 0) : of(count) {}
    std::vector<double> of;
    Sums& operator+=(const Sums& o) {
        std::ranges::transform(of, o.of, of.begin(), std::plus());
        return *this;
    }
};

}  // namespace dimmer::cook
