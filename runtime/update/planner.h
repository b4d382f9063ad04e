// From weights to work: which batches must be blended anew, with which contributions. No Vulkan in it.
#pragma once

#include <dimmer/light_state.h>
#include <pack/pack_data.h>
#include <update/plan_tables.h>

#include <algorithm>
#include <array>
#include <dimmer/work_list.glsl>
#include <memory>
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

// Whether a contribution is added at all: a texel without any is its base, to the bit.
inline bool isOn(const Weight& w) {
    return w.r != 0 || w.g != 0 || w.b != 0;
}

// Plans the updates of one set of pages. Each cluster is either as the weights say, or has batches that wait: which do,
// is a range of its batches, taken up round robin, so that a limit per plan starves none.
class Planner {
   public:
    // `data` must be valid and must outlive the planner. Pages are taken to hold the base. Reserves for the worst
    // case, so that later calls allocate nothing.
    Planner(const PackData& data, const ReceiverView& receivers, std::shared_ptr<const PlanTables> tables);
    Planner(const PackData& data, const ReceiverView& receivers)
        : Planner(data, receivers, std::make_shared<const PlanTables>(data, receivers)) {}
    explicit Planner(const PackData& data) : Planner(data, data.texelView()) {}  // of the lightmap's texels

    const Weight& element(uint32_t index) const { return elements_[index]; }
    // Constant time; takes effect with the next plan().
    void setElement(uint32_t index, Weight weight);
    // Of texels alone. In range already. The first limits of a planner cost a pass over the pack's records. Where there
    // is no memory for what they need it throws, and nothing has changed.
    void setLimits(const UpdateLimits& limits);
    // What of setLimits() may throw, so that several planners get limits together or not at all.
    void prepareLimits(const UpdateLimits& limits);
    // What waits must not be written with the weights that the last plan() saw.
    void startOver() { starts_over_ = true; }

    // Plans what changed since the last plan(), and what waits, and counts it as written. Cost: constant when there is
    // nothing to do, else in proportion to the clusters that hold a changed contribution. False: nothing to do, work()
    // is empty.
    bool plan();
    // The same for what waits alone; changes are left to the next plan(). Only where mayGoOn().
    bool planWaiting();
    // Something waits, and may be written with the weights that the last plan() saw: not after startOver(), a
    // rollback(), another tolerance, or the end of the limit on receivers.
    bool mayGoOn() const { return waiting() && !starts_over_; }
    // The last plan that had anything to do was not executed, or nobody knows: what it would have written is written by
    // the next plan(), whatever the weights are then.
    void rollback();
    // The same of every plan that there was: the next plan() writes all clusters.
    void rollbackAll();

    // Whether batches wait, as the last plan was limited.
    bool waiting() const { return !waiting_clusters_.empty(); }
    // Whether plan() has nothing to do: the pages hold what the weights say, or are within the tolerance of it. What is
    // put off for that is counted in stats(), as by plan(). Constant time after a yes, until a weight is set.
    bool upToDate();
    // Elements and contributions that the next upToDate() or plan() looks at: those that may have changed.
    size_t suspects() const { return dirty_elements_.size() + dirty_contributions_.size(); }

    const WorkList& work() const { return work_; }
    // As the last plan() left it; 0 is off.
    const Weight& plannedWeight(uint32_t contribution) const { return planned_[contribution]; }
    uint32_t contributionCount() const { return static_cast<uint32_t>(planned_.size()); }
    // Everything but dispatches and times.
    const UpdateStats& stats() const { return stats_; }

    // Largest sizes of a work list, for buffers.
    uint32_t itemsMax() const { return static_cast<uint32_t>(receivers_.batches.size()); }
    uint32_t termsMax() const { return static_cast<uint32_t>(receivers_.terms.size()); }
    // The largest number of contributions of any cluster.
    uint32_t overlapMax() const { return tables_->overlap_max; }

   private:
    struct Change {
        uint32_t contribution;
        Weight before;
    };
    // Batches of a cluster that wait: `count` of them from `first` on, going round.
    struct Waiting {
        uint32_t first = 0, count = 0;
        uint32_t plans = 0;  // since anything of it was written
        float quanta = 0;    // by which the light there has changed, at most
    };
    // A cluster that waits, in the heap of those that a limit chooses from.
    struct Urgent {
        float urgency;
        uint32_t cluster;
    };
    // A part of a cluster to write now, and its terms that are on.
    struct Part {
        uint32_t cluster, first_batch, batch_count;
        uint32_t first_term = 0, term_count = 0;
    };

    Weight product(const Contribution& contribution) const;
    void markDirty(uint32_t contribution);
    void gatherDirty();
    bool allWithinTolerance();
    void collectChanges();
    void touch(const Change& change);
    void touchMarked();
    void mark(uint32_t cluster);
    template <class Visit>
    void visitMarked(Visit&& visit);
    void waitWhole(uint32_t cluster);
    void writeAnew(uint32_t cluster);
    void forgetPlan();
    float quantaPutOff(const Cluster& cluster) const;
    void touchAllPutOff();
    bool finishPlan();
    void takeAll();
    static float urgency(const Waiting& waiting);
    void takeWithin(uint32_t receivers);
    uint32_t batchesWithin(uint32_t cluster, int64_t& receivers) const;
    void take(uint32_t cluster, uint32_t batches);
    void planPart(Part& part);
    void emitWork();

    const PackData& data_;
    const ReceiverView receivers_;
    std::shared_ptr<const PlanTables> tables_;
    UpdateLimits limits_;
    std::vector<float> quanta_per_weight_;  // per term; empty until there are limits
    std::vector<Weight> written_;           // per term, as clusters that do not wait hold it; likewise
    bool recheck_ = false;                  // a lower tolerance: look at every cluster
    bool starts_over_ = false;

    std::vector<Weight> elements_;  // as the game set them
    std::vector<Weight> planned_;   // per contribution
    std::vector<uint32_t> dirty_elements_, dirty_contributions_;
    std::vector<bool> element_is_dirty_, contribution_is_dirty_;

    std::vector<Change> changes_;             // of the last plan
    std::vector<Waiting> waiting_;            // per cluster
    std::vector<uint32_t> waiting_clusters_;  // those with a count
    std::vector<Urgent> urgent_;              // only within takeWithin(); no room until there are limits
    std::vector<uint64_t> cluster_marks_;     // one bit per cluster, all 0 between calls
    size_t first_mark_ = 0, end_mark_ = 0;    // the words with marks
    std::vector<Part> parts_;                 // of the last plan that had any, ascending by cluster
    std::vector<WorkItem> items_;
    std::vector<WorkTerm> terms_;
    WorkList work_;
    UpdateStats stats_;
};

// Adds what an update did to probes to what it did to texels.
inline void addProbes(const UpdateStats& probes, UpdateStats& stats) {
    stats.contributions_changed = std::max(stats.contributions_changed, probes.contributions_changed);
    stats.clusters += probes.clusters;
    stats.batches += probes.batches;
    stats.receivers += probes.receivers;
    stats.bytes_read += probes.bytes_read;
    stats.bytes_written += probes.bytes_written;
}

}  // namespace dimmer
