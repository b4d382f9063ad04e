// What a pack costs at run time, by category and by element, against a profile's budgets.
#pragma once

#include <pack/pack_data.h>
#include <pipeline/profile.h>

#include <cstdint>
#include <string>
#include <vector>

namespace dimmer::cook {

struct ElementCost {
    uint32_t element = 0;    // index into PackData::elements
    uint64_t receivers = 0;  // texels
    uint64_t bytes = 0;      // of the records of texels and probes
    uint64_t probe_bytes = 0;
};

// Device memory in bytes.
struct PackCost {
    uint64_t base_lightmap = 0;  // the page images
    uint64_t dynamic = 0;        // records of every contribution, and the base of the receivers that they touch
    uint64_t probe_records = 0;  // of which probes'
    uint64_t global_grid = 0;    // its probes as they stand with all sets off, and the tables to find them by
    uint64_t local_grids = 0;    // the probes of models as they stand with all sets off
    uint64_t ancillary = 0;      // addresses, weights and the work lists of the largest update
    uint64_t meshes = 0;         // host memory: what the pack hands to the engine
    uint64_t device() const { return base_lightmap + dynamic + global_grid + local_grids + ancillary; }
    std::vector<ElementCost> elements;
    std::vector<uint64_t> overlap_histogram;  // texels by number of contributions, from 0
};

PackCost costOf(const PackData& pack);

// A budget of 0 is none.
inline bool isOver(uint64_t bytes, uint64_t budget) {
    return budget > 0 && bytes > budget;
}

// Per category and per element: bytes, share of the budget, records of texels, energy dropped. Of the profile, its
// budgets count.
std::string budgetTable(const PackData& pack, const PackCost& cost, const Profile& budgets);

// An error of ErrorCode::OverBudget that says what is over, by how much, and who holds the most.
Expected<void> checkBudgets(const PackData& pack, const PackCost& cost, const Profile& profile);

}  // namespace dimmer::cook
