// How far light is from the truth: the project's error measures, shared by `dimmer verify` and the tests.
#pragma once

#include <cstddef>
#include <span>

namespace dimmer::cook {

// Luminance of the irradiance at one point, lux.
struct LightPair {
    double value_lux = 0;
    double reference_lux = 0;
    double reference_error_lux = 0;  // standard error
};

// Shares: 0.1 is ten per cent. What the reference's own noise adds is taken off in quadrature and stated beside.
struct ErrorFigures {
    double mean = 0, p95 = 0;         // of |E - E_ref| / (E_ref + floor)
    double rmse = 0;                  // root of the mean of (E - E_ref)^2, over the mean of E_ref
    double bias = 0;                  // (sum E - sum E_ref) / sum E_ref: too dark below 0
    double measured_mean = 0;         // as measured, reference noise included
    double reference_error_mean = 0;  // of standard error / (E_ref + floor)
    size_t points = 0;
};

// floor = 1 % of the mean E_ref of the state with all sets on (states may be black).
inline constexpr double floor_share = 0.01;
ErrorFigures lightError(std::span<const LightPair> pairs, double floor_lux);

// A reference closer to nothing than that many of its standard errors may be nothing.
inline constexpr double significant_errors = 3;

// What a light set or a door does: pairs hold dE, the light with it minus the light without. Over the points where
// |dE_ref| exceeds significant_errors. A baker that ignores the element scores 1. Points may stand for areas: with all
// three of a pair multiplied by its own.
struct EffectFigures {
    double error = 0;  // sum |dE - dE_ref| / sum |dE_ref|, reference noise taken off in quadrature
    double bias = 0;   // sum (dE - dE_ref) / sum |dE_ref|
    double measured_error = 0, reference_noise = 0;
    double sampling_error = 0;  // standard error of measured_error: other points would give another
    // Sum |dE - dE_ref| where dE_ref may be nothing and dE surely is not dE_ref, over the same sum |dE_ref|; 1 where no
    // point counts: then all that the element does is invented.
    double elsewhere = 0;
    double reference_sum_lux = 0;
    size_t points = 0;  // that count
};
EffectFigures effectError(std::span<const LightPair> pairs);

}  // namespace dimmer::cook
