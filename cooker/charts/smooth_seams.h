// Edges at which charts meet on a surface that is shaded as one.
#pragma once

#include <charts/unwrap.h>

#include <cstdint>
#include <set>
#include <utility>

namespace dimmer::cook {

// A round column is several charts; between them light is to go on as it does within them. Immutable after
// construction. Cost: a sort of the edges of faces that are shaded as round.
class SmoothSeams {
   public:
    SmoothSeams(const RayScene& rays, const Unwrap& unwrap);

    bool any(uint32_t chart) const;
    bool meet(uint32_t chart, uint32_t other) const { return pairs_.contains({chart, other}); }

   private:
    std::set<std::pair<uint32_t, uint32_t>> pairs_;  // both ways round
};

}  // namespace dimmer::cook
