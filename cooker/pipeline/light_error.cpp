#include <pipeline/light_error.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace dimmer::cook {
namespace {

// Of a normal distribution with standard deviation 1: the mean and the 95th percentile of its magnitude.
const double normal_mean_magnitude = std::sqrt(2 / std::numbers::pi);
constexpr double normal_p95_magnitude = 1.959964;

double withoutNoise(double measured, double noise) {
    return std::sqrt(std::max(0.0, measured * measured - noise * noise));
}

// The value with 95 % of the others below it (nearest rank).
double percentile95(std::vector<double> values) {
    const auto rank = static_cast<size_t>(std::ceil(0.95 * static_cast<double>(values.size()))) - 1;
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(rank));
    return values[rank];
}

}  // namespace

ErrorFigures lightError(std::span<const LightPair> pairs, double floor_lux) {
    ErrorFigures out;
    std::vector<double> errors;
    double sum = 0, difference = 0, squares = 0, noise_squares = 0;
    for (const LightPair& p : pairs) {
        const double scale = p.reference_lux + floor_lux, d = p.value_lux - p.reference_lux;
        if (!(scale > 0)) continue;  // a black reference without a floor: nothing to be measured against
        errors.push_back(std::abs(d) / scale);
        out.reference_error_mean += p.reference_error_lux / scale;
        sum += p.reference_lux;
        difference += d;
        squares += d * d;
        noise_squares += p.reference_error_lux * p.reference_error_lux;
    }
    out.points = errors.size();
    if (errors.empty()) return out;
    const auto n = static_cast<double>(errors.size());
    for (double e : errors) out.measured_mean += e / n;
    out.reference_error_mean /= n;
    out.mean = withoutNoise(out.measured_mean, normal_mean_magnitude * out.reference_error_mean);
    out.p95 = withoutNoise(percentile95(errors), normal_p95_magnitude * out.reference_error_mean);
    if (sum > 0) {
        out.rmse = std::sqrt(std::max(0.0, squares - noise_squares) / n) / (sum / n);
        out.bias = difference / sum;
    }
    return out;
}

EffectFigures effectError(std::span<const LightPair> pairs) {
    EffectFigures out;
    double difference = 0, magnitude = 0, noise = 0, elsewhere = 0;
    const auto counts = [](const LightPair& p) {
        return std::abs(p.reference_lux) > significant_errors * p.reference_error_lux;
    };
    for (const LightPair& p : pairs) {
        const double d = p.value_lux - p.reference_lux;
        if (!counts(p)) {
            if (std::abs(d) > significant_errors * p.reference_error_lux) elsewhere += std::abs(d);
            continue;
        }
        ++out.points;
        difference += d;
        magnitude += std::abs(d);
        noise += normal_mean_magnitude * p.reference_error_lux;
        out.reference_sum_lux += std::abs(p.reference_lux);
    }
    if (out.points == 0) {
        out.elsewhere = elsewhere > 0 ? 1 : 0;
        return out;
    }
    out.measured_error = magnitude / out.reference_sum_lux;
    out.reference_noise = noise / out.reference_sum_lux;
    out.error = withoutNoise(out.measured_error, out.reference_noise);
    out.bias = difference / out.reference_sum_lux;
    out.elsewhere = elsewhere / out.reference_sum_lux;
    // Of a ratio of sums, to first order.
    double squares = 0;
    for (const LightPair& p : pairs)
        if (counts(p)) {
            const double r = std::abs(p.value_lux - p.reference_lux) - out.measured_error * std::abs(p.reference_lux);
            squares += r * r;
        }
    out.sampling_error = std::sqrt(squares) / out.reference_sum_lux;
    return out;
}

}  // namespace dimmer::cook
