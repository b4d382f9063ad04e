#include <update/planner.h>

#include <format/texel.h>

#include <bit>
#include <cmath>
#include <utility>

namespace dimmer {
namespace {

// By how much the weights of any channel differ.
float distance(const Weight& a, const Weight& b) {
    return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

}  // namespace

Planner::Planner(const PackData& data, const ReceiverView& receivers, std::shared_ptr<const PlanTables> tables)
    : data_(data), receivers_(receivers), tables_(std::move(tables)) {
    for (const Element& element : data.elements)
        elements_.emplace_back(element.kind == ElementKind::LightSet ? std::min(1.0f, element.max_weight) : 0.0f);
    planned_.assign(data.contributions.size(), Weight(0));

    element_is_dirty_.resize(data.elements.size());
    contribution_is_dirty_.resize(data.contributions.size());
    dirty_elements_.reserve(data.elements.size());
    dirty_contributions_.reserve(data.contributions.size());
    changes_.reserve(data.contributions.size());
    waiting_.resize(receivers.clusters.size());
    waiting_clusters_.reserve(receivers.clusters.size());
    cluster_marks_.resize((receivers.clusters.size() + 63) / 64);
    parts_.reserve(receivers.clusters.size());
    items_.resize(itemsMax());
    terms_.reserve(termsMax());

    for (uint32_t k = 0; k < data.contributions.size(); ++k) markDirty(k);
}

void Planner::setElement(uint32_t index, Weight weight) {
    if (elements_[index] == weight) return;
    elements_[index] = weight;
    if (element_is_dirty_[index]) return;
    element_is_dirty_[index] = true;
    dirty_elements_.push_back(index);
}

void Planner::setLimits(const UpdateLimits& limits) {
    if (limits == limits_) return;
    // What may throw comes first: then nothing has changed.
    prepareLimits(limits);
    recheck_ = recheck_ || limits.tolerance_quanta < limits_.tolerance_quanta;
    // With another budget, what waits goes on: where it follows each frame's headroom, no state would ever be complete.
    starts_over_ = starts_over_ || limits.tolerance_quanta != limits_.tolerance_quanta || limits.receivers_max == 0;
    limits_ = limits;
}

void Planner::prepareLimits(const UpdateLimits& limits) {
    if (!quanta_per_weight_.empty() || limits == UpdateLimits{}) return;
    std::vector<float> quanta = quantaPerWeight(data_);
    std::vector<Weight> written;
    written.reserve(receivers_.terms.size());
    for (const ClusterTerm& term : receivers_.terms) written.push_back(planned_[term.contribution]);
    urgent_.reserve(receivers_.clusters.size());
    quanta_per_weight_ = std::move(quanta);
    written_ = std::move(written);
}

void Planner::markDirty(uint32_t contribution) {
    if (contribution_is_dirty_[contribution]) return;
    contribution_is_dirty_[contribution] = true;
    dirty_contributions_.push_back(contribution);
}

// w = dim * product of open * product of (1 - open); design: "a contribution is a record with a weight".
Weight Planner::product(const Contribution& contribution) const {
    float doors = 1;
    for (uint32_t door : contribution.doors_open) doors *= elements_[door].r;
    for (uint32_t door : contribution.doors_closed) doors *= 1.0f - elements_[door].r;
    const Weight dim = contribution.light_set ? elements_[*contribution.light_set] : Weight();
    return {dim.r * doors, dim.g * doors, dim.b * doors};
}

// Of contributions alone, and of those alone whose weight is another one now.
void Planner::gatherDirty() {
    for (uint32_t element : dirty_elements_) {
        element_is_dirty_[element] = false;
        for (uint32_t k : tables_->contributions_of_element[element]) markDirty(k);
    }
    dirty_elements_.clear();
    std::erase_if(dirty_contributions_, [&](uint32_t k) {
        contribution_is_dirty_[k] = product(data_.contributions[k]) != planned_[k];
        return !contribution_is_dirty_[k];
    });
}

bool Planner::upToDate() {
    stats_ = {};
    if (!waiting_clusters_.empty() || recheck_) return false;
    gatherDirty();
    return dirty_contributions_.empty() || (limits_.tolerance_quanta > 0 && allWithinTolerance());
}

// Whether every change may be put off; then all are, otherwise it is as if nobody had asked. Only where nothing waits.
bool Planner::allWithinTolerance() {
    changes_.clear();
    for (uint32_t k : dirty_contributions_)
        changes_.push_back({k, std::exchange(planned_[k], product(data_.contributions[k]))});
    for (const Change& change : changes_)
        for (const Holder& holder : tables_->holders_of_contribution[change.contribution]) mark(holder.cluster);
    uint32_t clusters = 0;
    bool beyond = false;
    visitMarked([&](uint32_t cluster) {
        ++clusters;
        beyond = beyond || quantaPutOff(receivers_.clusters[cluster]) > limits_.tolerance_quanta;
    });
    if (beyond) {
        for (const Change& change : changes_) planned_[change.contribution] = change.before;
        changes_.clear();
        return false;
    }
    for (uint32_t k : dirty_contributions_) contribution_is_dirty_[k] = false;
    dirty_contributions_.clear();
    stats_.contributions_changed = static_cast<uint32_t>(changes_.size());
    stats_.clusters_put_off = clusters;
    return true;
}

void Planner::collectChanges() {
    gatherDirty();
    for (uint32_t k : dirty_contributions_) {
        contribution_is_dirty_[k] = false;
        changes_.push_back({k, std::exchange(planned_[k], product(data_.contributions[k]))});
    }
    dirty_contributions_.clear();
    for (const Change& change : changes_) touch(change);
    touchMarked();
    if (recheck_) touchAllPutOff();
    recheck_ = starts_over_ = false;
}

void Planner::mark(uint32_t cluster) {
    const size_t word = cluster / 64;
    cluster_marks_[word] |= uint64_t{1} << (cluster % 64);
    first_mark_ = first_mark_ == end_mark_ ? word : std::min(first_mark_, word);
    end_mark_ = std::max(end_mark_, word + 1);
}

// In ascending order, and takes the marks away.
template <class Visit>
void Planner::visitMarked(Visit&& visit) {
    for (size_t word = first_mark_; word < end_mark_; ++word)
        for (uint64_t bits = std::exchange(cluster_marks_[word], 0); bits != 0; bits &= bits - 1)
            visit(static_cast<uint32_t>(word * 64) + static_cast<uint32_t>(std::countr_zero(bits)));
    first_mark_ = end_mark_ = 0;
}

void Planner::waitWhole(uint32_t cluster) {
    Waiting& waiting = waiting_[cluster];
    if (waiting.count == 0) waiting_clusters_.push_back(cluster);
    waiting.count = receivers_.clusters[cluster].batch_count;
}

void Planner::touch(const Change& change) {
    const float moved = distance(change.before, planned_[change.contribution]);
    for (const Holder& holder : tables_->holders_of_contribution[change.contribution]) {
        Waiting& waiting = waiting_[holder.cluster];
        if (!quanta_per_weight_.empty()) waiting.quanta += moved * quanta_per_weight_[holder.term];
        if (limits_.tolerance_quanta > 0 && waiting.count == 0)
            mark(holder.cluster);
        else
            waitWhole(holder.cluster);
    }
}

// Once every weight is known, and once per cluster: what is put off depends on all of its contributions.
void Planner::touchMarked() {
    visitMarked([&](uint32_t cluster) {
        if (quantaPutOff(receivers_.clusters[cluster]) > limits_.tolerance_quanta) return waitWhole(cluster);
        ++stats_.clusters_put_off;
        waiting_[cluster] = {};
    });
}

// How far the light of a cluster that does not wait is from what the weights say, at most: measured from what was
// written, so many small changes cannot add up unseen.
float Planner::quantaPutOff(const Cluster& cluster) const {
    float quanta = 0;
    for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t)
        quanta += distance(written_[t], planned_[receivers_.terms[t].contribution]) * quanta_per_weight_[t];
    return quanta;
}

void Planner::touchAllPutOff() {
    if (written_.empty()) return;
    for (uint32_t i = 0; i < receivers_.clusters.size(); ++i)
        if (waiting_[i].count == 0 && quantaPutOff(receivers_.clusters[i]) > limits_.tolerance_quanta) waitWhole(i);
}

// So many of a cluster's next waiting batches hold no more than `receivers`, which they are taken off; one in any case.
uint32_t Planner::batchesWithin(uint32_t cluster_index, int64_t& receivers) const {
    const Cluster& cluster = receivers_.clusters[cluster_index];
    const Waiting& waiting = waiting_[cluster_index];
    uint32_t batches = 0;
    for (; batches < waiting.count; ++batches) {
        const uint32_t next = cluster.first_batch + (waiting.first + batches) % cluster.batch_count;
        const int64_t more = receivers_.batches[next].receiver_count;
        if (batches > 0 && more > receivers) break;
        receivers -= more;
    }
    return batches;
}

// The next so many of a cluster's waiting batches become a part.
void Planner::take(uint32_t cluster_index, uint32_t batches) {
    const Cluster& cluster = receivers_.clusters[cluster_index];
    Waiting& waiting = waiting_[cluster_index];
    parts_.push_back({cluster_index, waiting.first, batches});
    waiting.first = (waiting.first + batches) % cluster.batch_count;
    waiting.plans = 0;
    waiting.quanta *= 1 - static_cast<float>(batches) / static_cast<float>(waiting.count);
    waiting.count -= batches;
    if (waiting.count > 0) return;
    waiting = {};
    if (written_.empty()) return;
    for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t)
        written_[t] = planned_[receivers_.terms[t].contribution];
}

// In ascending order: neighbours on the pages are neighbours in memory. Through a bit per cluster, without sorting.
void Planner::takeAll() {
    for (const uint32_t cluster : waiting_clusters_) mark(cluster);
    visitMarked([&](uint32_t cluster) { take(cluster, waiting_[cluster].count); });
    waiting_clusters_.clear();
}

// More steps of the format than this are plain to see. Where the base is black a step is tiny, and any light would be
// more than all other changes of a level.
constexpr float plain_quanta = 1023;

// The most visible first; what has waited counts for more with every plan. By the square: something faint waits behind
// what changes in every frame for as many plans as the root of how much more that shows, 32 at most.
float Planner::urgency(const Waiting& waiting) {
    const auto waited = static_cast<float>(waiting.plans + 1);
    return (std::min(waiting.quanta, plain_quanta) + 1) * waited * waited;
}

// By a heap: a budget takes few of many, and a sort would put all in order.
void Planner::takeWithin(uint32_t receivers) {
    urgent_.clear();
    for (const uint32_t cluster : waiting_clusters_) urgent_.push_back({urgency(waiting_[cluster]), cluster});
    const auto behind = [](const Urgent& a, const Urgent& b) {
        return a.urgency != b.urgency ? a.urgency < b.urgency : a.cluster > b.cluster;
    };
    std::ranges::make_heap(urgent_, behind);
    int64_t left = receivers;
    while (!urgent_.empty()) {
        if (left < batch_receivers_max && !parts_.empty()) break;
        std::ranges::pop_heap(urgent_, behind);
        const uint32_t cluster = urgent_.back().cluster;
        urgent_.pop_back();
        take(cluster, batchesWithin(cluster, left));
    }
    std::ranges::sort(parts_, {}, &Part::cluster);
    std::erase_if(waiting_clusters_, [&](uint32_t cluster) { return waiting_[cluster].count == 0; });
    for (uint32_t cluster : waiting_clusters_) {
        ++waiting_[cluster].plans;
        stats_.receivers_waiting +=
            std::min(waiting_[cluster].count * batch_receivers_max, receivers_.clusters[cluster].receiver_count);
    }
}

// Lists the cluster's terms that are on, and counts.
void Planner::planPart(Part& part) {
    const Cluster& cluster = receivers_.clusters[part.cluster];
    part.first_term = static_cast<uint32_t>(terms_.size());
    const float scale = weightScale(data_.color_format);
    for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t) {
        const Weight& w = planned_[receivers_.terms[t].contribution];
        if (isOn(w)) terms_.push_back({t, w.r * scale, w.g * scale, w.b * scale});
    }
    part.term_count = static_cast<uint32_t>(terms_.size()) - part.first_term;
    uint64_t receivers = cluster.receiver_count;
    if (part.batch_count < cluster.batch_count) {
        receivers = 0;
        for (uint32_t b = 0; b < part.batch_count; ++b)
            receivers +=
                receivers_.batches[cluster.first_batch + (part.first_batch + b) % cluster.batch_count].receiver_count;
    }
    work_.groups[workGroupOf(part.term_count)].item_count += part.batch_count;
    ++stats_.clusters;
    stats_.batches += part.batch_count;
    stats_.receivers += receivers;
    stats_.bytes_read += receivers * (receivers_.place_bytes + receivers_.record_bytes * (1 + part.term_count));
    stats_.bytes_written += receivers * receivers_.record_bytes;
}

void Planner::emitWork() {
    for (Part& part : parts_) planPart(part);
    std::array<uint32_t, work_group_count> next{};
    for (uint32_t g = 1; g < work_group_count; ++g)
        next[g] = work_.groups[g].first_item = work_.groups[g - 1].first_item + work_.groups[g - 1].item_count;
    for (const Part& part : parts_) {
        const Cluster& cluster = receivers_.clusters[part.cluster];
        uint32_t& item = next[workGroupOf(part.term_count)];
        for (uint32_t b = 0; b < part.batch_count; ++b) {
            const uint32_t batch = (part.first_batch + b) % cluster.batch_count;
            items_[item++] = {cluster.first_batch + batch, part.first_term, part.term_count, part.cluster};
        }
    }
    work_.items = std::span(items_).first(stats_.batches);
    work_.terms = terms_;
}

bool Planner::plan() {
    work_ = {};
    stats_ = {};
    changes_.clear();
    collectChanges();
    stats_.contributions_changed = static_cast<uint32_t>(changes_.size());
    return finishPlan();
}

bool Planner::planWaiting() {
    work_ = {};
    stats_ = {};
    return finishPlan();
}

bool Planner::finishPlan() {
    terms_.clear();
    if (waiting_clusters_.empty()) return false;  // and the parts of before stay for rollback()
    parts_.clear();
    if (limits_.receivers_max == 0)
        takeAll();
    else
        takeWithin(limits_.receivers_max);
    emitWork();
    return stats_.batches > 0;
}

void Planner::writeAnew(uint32_t cluster) {
    waitWhole(cluster);
    waiting_[cluster].quanta = plain_quanta;  // a limit chose it for being visible
}

void Planner::forgetPlan() {
    starts_over_ = true;  // the weights of a plan that never ran are no state to go on with
    parts_.clear();
    work_ = {};
    stats_ = {};
}

void Planner::rollback() {
    for (const Part& part : parts_) writeAnew(part.cluster);
    forgetPlan();
}

void Planner::rollbackAll() {
    for (uint32_t cluster = 0; cluster < receivers_.clusters.size(); ++cluster) writeAnew(cluster);
    forgetPlan();
}

}  // namespace dimmer
