// From weights to work: which batches must be blended anew, with which contributions. No Vulkan in it.
#pragma once

#include <dimmer/light_state.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <array>
#include <dimmer/work_list.glsl>
#include <span>
#include <vector>

namespace dimmer {

// Work is grouped by the number of contributions that are on: each group has a kernel of its own, unrolled up to 16 of
// them. One dispatch per group that is not empty.
inline constexpr std::array<uint32_t, 11> unrolled_terms = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16};
inline constexpr uint32_t work_group_count = unrolled_terms.size() + 1;  // the last one: any number, in a loop

inline uint32_t workGroupOf(uint32_t terms_on) {
    return static_cast<uint32_t>(std::ranges::lower_bound(unrolled_terms, terms_on) - unrolled_terms.begin());
}

struct WorkGroup {
    uint32_t first_item = 0, item_count = 0;  // into WorkList::items
};

// Valid until the next plan(). Executing it makes every page texel of the changed clusters a function of the weights
// alone: base first, then the terms in ascending order of contribution.
struct WorkList {
    std::span<const WorkItem> items;
    std::span<const WorkTerm> terms;
    std::array<WorkGroup, work_group_count> groups{};
};

// Weights above this are taken as this: every texel they touch is as bright as the format goes.
inline constexpr float planned_weight_max = 0x1p27f;

class Planner {
   public:
    // `data` must be valid and must outlive the planner. Pages are taken to hold the base. Reserves for the worst
    // case, so that later calls allocate nothing.
    explicit Planner(const PackData& data);

    const Weight& element(uint32_t index) const { return elements_[index]; }
    // Constant time; takes effect with the next plan().
    void setElement(uint32_t index, Weight weight);

    // Plans what changed since the last plan() and counts it as written. Cost: constant when nothing changed, else
    // in proportion to the clusters that hold a changed contribution. False: nothing to do, work() is empty.
    bool plan();
    // The last plan was not executed: what it would have written is written by the next one.
    void rollback();

    const WorkList& work() const { return work_; }
    // As the last plan() left it; 0 is off.
    const Weight& plannedWeight(uint32_t contribution) const { return planned_[contribution]; }
    uint32_t contributionCount() const { return static_cast<uint32_t>(planned_.size()); }
    // Everything but dispatches and times.
    const UpdateStats& stats() const { return stats_; }

    // Largest sizes of a work list, for buffers.
    uint32_t itemsMax() const { return static_cast<uint32_t>(data_.batches.size()); }
    uint32_t termsMax() const { return static_cast<uint32_t>(data_.terms.size()); }
    // The largest number of contributions of any cluster.
    uint32_t overlapMax() const { return overlap_max_; }

   private:
    // Lists of lists in one array: list i is values[first[i] .. first[i + 1]).
    struct Lists {
        std::vector<uint32_t> first, values;
        std::span<const uint32_t> operator[](uint32_t i) const;
    };
    struct Change {
        uint32_t contribution;
        Weight before;
    };

    void buildLists();
    Weight product(const Contribution& contribution) const;
    void markDirty(uint32_t contribution);
    void collectChanges();
    void collectClusters();
    // The terms that are on in a cluster, in terms_.
    struct Terms {
        uint32_t first = 0, count = 0;
    };

    Terms planCluster(const Cluster& cluster);
    void emitWork();

    const PackData& data_;
    Lists contributions_of_element_, clusters_of_contribution_;
    uint32_t overlap_max_ = 0;

    std::vector<Weight> elements_;  // as the game set them
    std::vector<Weight> planned_;   // per contribution, as the pages hold it
    std::vector<uint32_t> dirty_elements_, dirty_contributions_;
    std::vector<bool> element_is_dirty_, contribution_is_dirty_;

    std::vector<Change> changes_;             // of the last plan
    std::vector<uint64_t> cluster_marks_;     // one bit per cluster
    std::vector<uint32_t> changed_clusters_;  // ascending
    std::vector<Terms> cluster_terms_;        // of changed_clusters_
    std::vector<WorkItem> items_;
    std::vector<WorkTerm> terms_;
    WorkList work_;
    UpdateStats stats_;
};

}  // namespace dimmer
