#include <update/planner.h>

#include <format/texel.h>

#include <bit>

namespace dimmer {
namespace {

bool isOn(const Weight& w) {
    return w.r != 0 || w.g != 0 || w.b != 0;
}

// Pairs (list, value) into lists; values keep their order.
template <class Lists, class ForEachPair>
Lists makeLists(size_t list_count, ForEachPair&& for_each_pair) {
    Lists lists;
    lists.first.assign(list_count + 1, 0);
    for_each_pair([&](uint32_t list, uint32_t) { ++lists.first[list + 1]; });
    for (size_t i = 1; i <= list_count; ++i) lists.first[i] += lists.first[i - 1];
    lists.values.resize(lists.first[list_count]);
    std::vector<uint32_t> next = lists.first;
    for_each_pair([&](uint32_t list, uint32_t value) { lists.values[next[list]++] = value; });
    return lists;
}

}  // namespace

std::span<const uint32_t> Planner::Lists::operator[](uint32_t i) const {
    return std::span(values).subspan(first[i], first[i + 1] - first[i]);
}

Planner::Planner(const PackData& data) : data_(data) {
    buildLists();

    for (const Element& element : data.elements)
        elements_.emplace_back(element.kind == ElementKind::LightSet ? std::min(1.0f, element.max_weight) : 0.0f);
    planned_.assign(data.contributions.size(), Weight(0));

    element_is_dirty_.resize(data.elements.size());
    contribution_is_dirty_.resize(data.contributions.size());
    dirty_elements_.reserve(data.elements.size());
    dirty_contributions_.reserve(data.contributions.size());
    changes_.reserve(data.contributions.size());
    cluster_marks_.resize((data.clusters.size() + 63) / 64);
    changed_clusters_.reserve(data.clusters.size());
    cluster_terms_.reserve(data.clusters.size());
    items_.resize(itemsMax());
    terms_.reserve(termsMax());

    for (uint32_t k = 0; k < data.contributions.size(); ++k) markDirty(k);
}

void Planner::buildLists() {
    contributions_of_element_ = makeLists<Lists>(data_.elements.size(), [&](auto&& pair) {
        for (uint32_t k = 0; k < data_.contributions.size(); ++k) {
            const Contribution& c = data_.contributions[k];
            if (c.light_set) pair(*c.light_set, k);
            for (uint32_t door : c.doors_open) pair(door, k);
            for (uint32_t door : c.doors_closed) pair(door, k);
        }
    });
    clusters_of_contribution_ = makeLists<Lists>(data_.contributions.size(), [&](auto&& pair) {
        for (uint32_t i = 0; i < data_.clusters.size(); ++i) {
            const Cluster& c = data_.clusters[i];
            for (uint32_t t = 0; t < c.term_count; ++t) pair(data_.terms[c.first_term + t].contribution, i);
        }
    });
    for (const Cluster& c : data_.clusters) overlap_max_ = std::max(overlap_max_, c.term_count);
}

void Planner::setElement(uint32_t index, Weight weight) {
    if (elements_[index] == weight) return;
    elements_[index] = weight;
    if (element_is_dirty_[index]) return;
    element_is_dirty_[index] = true;
    dirty_elements_.push_back(index);
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
    const auto bounded = [doors](float channel) { return std::min(channel * doors, planned_weight_max); };
    return {bounded(dim.r), bounded(dim.g), bounded(dim.b)};
}

void Planner::collectChanges() {
    for (uint32_t element : dirty_elements_) {
        element_is_dirty_[element] = false;
        for (uint32_t k : contributions_of_element_[element]) markDirty(k);
    }
    dirty_elements_.clear();

    changes_.clear();
    for (uint32_t k : dirty_contributions_) {
        contribution_is_dirty_[k] = false;
        const Weight weight = product(data_.contributions[k]);
        if (weight == planned_[k]) continue;
        changes_.push_back({k, planned_[k]});
        planned_[k] = weight;
    }
    dirty_contributions_.clear();
}

// Through a bit per cluster: no cluster twice, and in ascending order, without sorting.
void Planner::collectClusters() {
    size_t first_word = cluster_marks_.size(), end_word = 0;
    for (const Change& change : changes_) {
        const auto clusters = clusters_of_contribution_[change.contribution];
        if (clusters.empty()) continue;
        for (uint32_t i : clusters) cluster_marks_[i / 64] |= uint64_t{1} << (i % 64);
        first_word = std::min<size_t>(first_word, clusters.front() / 64);
        end_word = std::max<size_t>(end_word, clusters.back() / 64 + 1);
    }
    changed_clusters_.clear();
    for (size_t word = first_word; word < end_word; ++word) {
        for (uint64_t bits = cluster_marks_[word]; bits != 0; bits &= bits - 1)
            changed_clusters_.push_back(static_cast<uint32_t>(word * 64) +
                                        static_cast<uint32_t>(std::countr_zero(bits)));
        cluster_marks_[word] = 0;
    }
}

// Lists the cluster's terms that are on, and counts.
Planner::Terms Planner::planCluster(const Cluster& cluster) {
    const auto first_term = static_cast<uint32_t>(terms_.size());
    const float scale = weightScale(data_.color_format);
    for (uint32_t slot = 0; slot < cluster.term_count; ++slot) {
        const Weight& w = planned_[data_.terms[cluster.first_term + slot].contribution];
        if (isOn(w)) terms_.push_back({slot, w.r * scale, w.g * scale, w.b * scale});
    }
    const uint32_t on = static_cast<uint32_t>(terms_.size()) - first_term;
    work_.groups[workGroupOf(on)].item_count += cluster.batch_count;
    ++stats_.clusters;
    stats_.batches += cluster.batch_count;
    stats_.receivers += cluster.receiver_count;
    stats_.bytes_read += uint64_t{cluster.receiver_count} * (sizeof(uint32_t) + sizeof(TexelRecord) * (1 + on));
    stats_.bytes_written += uint64_t{cluster.receiver_count} * sizeof(TexelRecord);
    return {first_term, on};
}

void Planner::emitWork() {
    cluster_terms_.clear();
    for (uint32_t i : changed_clusters_) cluster_terms_.push_back(planCluster(data_.clusters[i]));
    std::array<uint32_t, work_group_count> next{};
    for (uint32_t g = 1; g < work_group_count; ++g)
        next[g] = work_.groups[g].first_item = work_.groups[g - 1].first_item + work_.groups[g - 1].item_count;
    for (size_t c = 0; c < changed_clusters_.size(); ++c) {
        const Cluster& cluster = data_.clusters[changed_clusters_[c]];
        const Terms& terms = cluster_terms_[c];
        uint32_t& item = next[workGroupOf(terms.count)];
        for (uint32_t b = 0; b < cluster.batch_count; ++b)
            items_[item++] = {cluster.first_batch + b, terms.first, terms.count, changed_clusters_[c]};
    }
}

bool Planner::plan() {
    work_ = {};
    stats_ = {};
    terms_.clear();
    collectChanges();
    stats_.contributions_changed = static_cast<uint32_t>(changes_.size());
    if (changes_.empty()) return false;
    collectClusters();
    emitWork();
    work_.items = std::span(items_).first(stats_.batches);
    work_.terms = terms_;
    return stats_.batches > 0;
}

void Planner::rollback() {
    for (const Change& change : changes_) {
        planned_[change.contribution] = change.before;
        markDirty(change.contribution);
    }
    changes_.clear();
    work_ = {};
    stats_ = {};
}

}  // namespace dimmer
