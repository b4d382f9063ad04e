// What to change so that a pack fits its budgets, and what that costs.
#pragma once

#include <pipeline/budget.h>
#include <pipeline/losses.h>
#include <pipeline/remedy.h>

#include <vector>

namespace dimmer::cook {

inline constexpr const char* density_key = "lightmaps.texels_per_metre";
inline constexpr double density_factor_max = 16;  // pages whose texels are longer are none

// For a pack that is over a budget: what --fit would do, and by themselves raising thresholds where the least light
// goes for the bytes, raising all of them, raising that of the set with the most records, lowering the density, fewer
// probes; or of probes and texels their share. None is empty, none costs more light than there is, and none is
// dominated. Those that fit first, then by error; where a grid itself is over, what makes that smaller before what does
// not.
std::vector<Remedy> remedies(const PackData& pack, const PackCost& cost, const Profile& profile,
                             const LossTable& losses);

// What `cook --fit` does: thresholds of the light groups (of always-on light by that of all) or density, with as many
// probes as lose least in all; further than predicted where so many steps of density fell short. Empty where all of
// that together, texels no more than 16 times as long as they are now, is predicted not to do.
Remedy fittingRemedy(const PackData& pack, const PackCost& cost, const Profile& profile, const LossTable& losses,
                     size_t density_steps = 0);

}  // namespace dimmer::cook
