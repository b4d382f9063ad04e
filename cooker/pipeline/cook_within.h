// `cook --fit`: cooks until the pack is within its budgets.
#pragma once

#include <pipeline/cook.h>

namespace dimmer::cook {

// Cooks by result.profile, and with `fit` changes that and cooks again until the pack is within its budgets; what was
// changed goes into result.fitted, with a warning of each. An error of ErrorCode::OverBudget names the ways out;
// result.remedies has them, and result.pack is what was too large. One too where more than `fit_error_max` would have
// to be added.
Expected<PackData> cookWithin(const Scene& scene, const CookOptions& options, Progress& progress, CookCache* cache,
                              CookResult& result);

// What `--fit` changes.
Expected<void> applyRemedy(const Remedy& remedy, Profile& profile);

}  // namespace dimmer::cook
