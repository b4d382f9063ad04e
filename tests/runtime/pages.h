// Shared by tests that hold runtimes against each other.
#pragma once

#include <dimmer/light_state.h>
#include <gtest/gtest.h>

#include "random_pack.h"

#include <algorithm>
#include <stdexcept>

namespace dimmer::test {

// What a call that must succeed gave; throws its message otherwise.
template <class T>
T valueOf(Expected<T> expected) {
    if (!expected) throw std::runtime_error(expected.error().message);
    return std::move(*expected);
}

inline Pack packOf(PackData data) {
    auto pack = Pack::fromData(std::move(data));
    if (!pack) throw std::runtime_error(pack.error().message);
    return *pack;
}

inline void setElement(LightState& state, uint32_t index, float value) {
    const bool door = state.pack().elements()[index].kind == ElementKind::Door;
    const auto ok = door ? state.setDoor(Door{index}, value) : state.setWeight(LightSet{index}, value);
    ASSERT_TRUE(ok) << ok.error().message;
}

// Gives `to` the weights and doors of `from`, of the same pack.
inline void copyState(const LightState& from, LightState& to) {
    for (uint32_t i = 0; i < from.pack().elements().size(); ++i) {
        if (from.pack().elements()[i].kind == ElementKind::Door)
            ASSERT_TRUE(to.setDoor(Door{i}, from.open(Door{i})));
        else
            ASSERT_TRUE(to.setWeight(LightSet{i}, from.weight(LightSet{i})));
    }
}

// Elements go on, off or in between, one at a time; `update` after each.
template <class Update>
void toggleAtRandom(LightState& state, Random& random, uint32_t count, Update&& update) {
    const auto elements = static_cast<uint32_t>(state.pack().elements().size());
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t element = pick(random, 0, elements - 1);
        constexpr float values[] = {0, 1, 0.3f, 0.7f};
        setElement(state, element, values[pick(random, 0, 3)]);
        update();
    }
}

// The same pack with its clusters, and the batches in them, in the opposite order.
inline PackData withClustersReversed(const PackData& data) {
    PackData out = data;
    out.clusters.clear();
    out.terms.clear();
    out.batches.clear();
    out.addresses.clear();
    std::vector<uint32_t> next(1, 0);
    for (const Contribution& c : data.contributions) next.push_back(next.back() + c.receivers);
    for (auto c = data.clusters.rbegin(); c != data.clusters.rend(); ++c) {
        Cluster cluster = *c;
        cluster.first_receiver = static_cast<uint32_t>(out.addresses.size());
        cluster.first_batch = static_cast<uint32_t>(out.batches.size());
        cluster.first_term = static_cast<uint32_t>(out.terms.size());
        for (uint32_t i = 0; i < c->receiver_count; ++i)
            out.addresses.push_back(data.addresses[c->first_receiver + c->receiver_count - 1 - i]);
        cutIntoBatches(out.addresses, out.page_width, cluster.first_receiver, out.batches);
        cluster.batch_count = static_cast<uint32_t>(out.batches.size()) - cluster.first_batch;
        for (uint32_t t = c->first_term; t < c->first_term + c->term_count; ++t) {
            const ClusterTerm& term = data.terms[t];
            const uint32_t first = next[term.contribution];
            out.terms.push_back({term.contribution, first});
            for (uint32_t i = 0; i < c->receiver_count; ++i)
                out.payload[first + i] = data.payload[term.first_record + c->receiver_count - 1 - i];
            next[term.contribution] += c->receiver_count;
        }
        out.clusters.push_back(cluster);
    }
    return out;
}

}  // namespace dimmer::test
