#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <update/planner.h>

#include "random_pack.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace dimmer {
namespace {

// The records that a plan reads at each receiver, as indices into the payload.
std::map<uint32_t, std::vector<uint32_t>> recordsRead(const Planner& planner, const PackData& data) {
    std::map<uint32_t, std::vector<uint32_t>> reads;
    const WorkList& work = planner.work();
    for (const WorkItem& item : work.items) {
        const Batch& batch = data.batches[item.batch];
        const Cluster& cluster = data.clusters[item.cluster];
        for (uint32_t i = batch.first_receiver; i < batch.first_receiver + batch.receiver_count; ++i) {
            EXPECT_FALSE(reads.contains(i)) << "receiver " << i << " is written twice";
            auto& records = reads[i];
            for (uint32_t t = 0; t < item.term_count; ++t) {
                const uint32_t term = work.terms[item.first_term + t].term;
                records.push_back(data.terms[term].first_record + i - cluster.first_receiver);
            }
        }
    }
    return reads;
}

// The same from the pack: clusters that hold a contribution of `changed`, records of contributions of `on`.
std::map<uint32_t, std::vector<uint32_t>> recordsExpected(const PackData& data, const std::set<uint32_t>& changed,
                                                          const std::set<uint32_t>& on) {
    std::map<uint32_t, std::vector<uint32_t>> reads;
    for (const Cluster& c : data.clusters) {
        const auto terms = std::span(data.terms).subspan(c.first_term, c.term_count);
        if (std::none_of(terms.begin(), terms.end(), [&](auto& t) { return changed.contains(t.contribution); }))
            continue;
        for (uint32_t i = 0; i < c.receiver_count; ++i) {
            auto& records = reads[c.first_receiver + i];
            for (const ClusterTerm& term : terms)
                if (on.contains(term.contribution)) records.push_back(term.first_record + i);
        }
    }
    return reads;
}

// A pack whose contribution k belongs to set k alone.
PackData setsOnly(uint32_t seed) {
    return test::randomPack(seed, {.sets = 14, .doors = 0});
}

std::set<uint32_t> allOf(const PackData& data) {
    std::set<uint32_t> all;
    for (uint32_t k = 0; k < data.contributions.size(); ++k) all.insert(k);
    return all;
}

TEST(Planner, TheFirstPlanCoversWhatIsOn) {
    const PackData data = setsOnly(1);
    Planner planner(data);
    ASSERT_TRUE(planner.plan());
    EXPECT_EQ(recordsRead(planner, data), recordsExpected(data, allOf(data), allOf(data)));
}

TEST(Planner, WithEverythingOffAtTheStartPagesHoldTheBaseAlready) {
    const PackData data = setsOnly(1);
    Planner planner(data);
    for (uint32_t i = 0; i < data.elements.size(); ++i) planner.setElement(i, 0);
    EXPECT_FALSE(planner.plan());
    EXPECT_TRUE(planner.work().items.empty());
}

TEST(Planner, NothingChangedIsNoWork) {
    const PackData data = setsOnly(2);
    Planner planner(data);
    planner.plan();
    EXPECT_FALSE(planner.plan());
    planner.setElement(3, 1);  // as it was
    EXPECT_FALSE(planner.plan());
    planner.setElement(3, 0.5f);
    planner.setElement(3, 1);  // and back again
    EXPECT_FALSE(planner.plan());
    EXPECT_EQ(planner.stats().contributions_changed, 0u);
    EXPECT_EQ(planner.stats().batches, 0u);
}

// What went and came back is looked at once, not with every idle update from then on.
TEST(Planner, WhatProvedUnchangedIsNotLookedAtAgain) {
    const PackData data = test::randomPack(9);
    Planner planner(data);
    planner.plan();
    EXPECT_TRUE(planner.upToDate());
    for (uint32_t i = 0; i < data.elements.size(); ++i) {
        const Weight before = planner.element(i);
        planner.setElement(i, 0.5f);
        planner.setElement(i, before);
    }
    EXPECT_EQ(planner.suspects(), data.elements.size());
    EXPECT_TRUE(planner.upToDate());
    EXPECT_EQ(planner.suspects(), 0u);
    // Of two sets that changed one comes back.
    planner.setElement(1, 0.5f);
    planner.setElement(2, 0.5f);
    EXPECT_FALSE(planner.upToDate());
    const size_t of_both = planner.suspects();
    planner.setElement(2, 1);
    EXPECT_FALSE(planner.upToDate());
    EXPECT_GT(planner.suspects(), 0u);
    EXPECT_LT(planner.suspects(), of_both);
    planner.setElement(1, 1);
    EXPECT_TRUE(planner.upToDate());
    EXPECT_EQ(planner.suspects(), 0u);
    EXPECT_FALSE(planner.plan());
}

// Asking changes no answer: of two planners with one history the one that is asked before every plan plans the same.
TEST(Planner, UpToDateIsWhatThePlanFinds) {
    PackData data = test::randomPack(10);
    test::Random records(10);
    const auto light = [&](float low, float high) {
        const uint32_t code = test::floorUfloatCode(test::uniform(records, low, high), 6);
        return code | code << 11;
    };
    // No black base: there a step of the format is so small that any change is more of them than are tolerated.
    for (TexelRecord& record : data.base_pages) record.irradiance = light(10, 1000);
    for (TexelRecord& record : data.payload) record.irradiance = light(1, 100);
    for (const float tolerance : {0.0f, 2.0f, 50.0f}) {
        Planner asked(data), silent(data);
        asked.setLimits({.tolerance_quanta = tolerance});
        silent.setLimits({.tolerance_quanta = tolerance});
        test::Random random(10);
        uint32_t idle = 0, put_off = 0;
        for (int step = 0; step < 400; ++step) {
            const uint32_t element = test::pick(random, 0, static_cast<uint32_t>(data.elements.size()) - 1);
            const float by = test::uniform(random, -1e-3f, 1e-3f);
            const float value = std::clamp(asked.element(element).r + by, 0.0f, 1.0f);
            asked.setElement(element, value);
            silent.setElement(element, value);
            const bool up_to_date = asked.upToDate();
            const UpdateStats found = asked.stats();
            ASSERT_EQ(up_to_date, !silent.plan());
            idle += up_to_date;
            put_off += up_to_date && silent.stats().clusters_put_off > 0;
            if (up_to_date) {
                ASSERT_EQ(found.clusters_put_off, silent.stats().clusters_put_off);
                ASSERT_EQ(found.contributions_changed, silent.stats().contributions_changed);
            }
            ASSERT_EQ(asked.plan(), !up_to_date);
            ASSERT_EQ(recordsRead(asked, data), recordsRead(silent, data));
        }
        EXPECT_EQ(put_off > 0, tolerance > 0);
        EXPECT_LT(idle, 400u) << "something was written";
    }
}

TEST(Planner, OneSetToggledReadsOnlyWhatIsOnWhereItIsHeld) {
    const PackData data = setsOnly(3);
    Planner planner(data);
    planner.plan();
    std::set<uint32_t> on = allOf(data);
    for (uint32_t k = 0; k < data.contributions.size(); ++k) {
        planner.setElement(k, 0);
        on.erase(k);
        ASSERT_TRUE(planner.plan());
        // An off set's records are not among those read, nor are those of clusters without it.
        EXPECT_EQ(recordsRead(planner, data), recordsExpected(data, {k}, on));
        EXPECT_EQ(planner.stats().contributions_changed, 1u);
    }
}

TEST(Planner, CountsAreThoseOfTheClusters) {
    const PackData data = setsOnly(4);
    Planner planner(data);
    planner.plan();
    planner.setElement(5, 0.5f);
    ASSERT_TRUE(planner.plan());
    UpdateStats expected;
    for (const Cluster& c : data.clusters) {
        const auto terms = std::span(data.terms).subspan(c.first_term, c.term_count);
        if (std::none_of(terms.begin(), terms.end(), [](auto& t) { return t.contribution == 5; })) continue;
        ++expected.clusters;
        expected.batches += (c.receiver_count + 63) / 64;
        expected.receivers += c.receiver_count;
        expected.bytes_read += uint64_t{c.receiver_count} * (1 + 8 + 8 * c.term_count);
        expected.bytes_written += uint64_t{c.receiver_count} * 8;
    }
    ASSERT_GT(expected.clusters, 0u);
    EXPECT_EQ(planner.stats().clusters, expected.clusters);
    EXPECT_EQ(planner.stats().batches, expected.batches);
    EXPECT_EQ(planner.stats().receivers, expected.receivers);
    EXPECT_EQ(planner.stats().bytes_read, expected.bytes_read);
    EXPECT_EQ(planner.stats().bytes_written, expected.bytes_written);
}

TEST(Planner, ItemsAreGroupedByTheNumberOfTermsThatAreOn) {
    const PackData data = test::randomPack(5, {.sets = 30, .doors = 0, .clusters = 60, .overlap_max = 20});
    Planner planner(data);
    planner.plan();
    uint32_t items = 0;
    for (uint32_t g = 0; g < work_group_count; ++g) {
        const WorkGroup group = planner.work().groups[g];
        EXPECT_EQ(group.first_item, items);
        items += group.item_count;
        for (const WorkItem& item : planner.work().items.subspan(group.first_item, group.item_count)) {
            const uint32_t terms = item.term_count;
            EXPECT_EQ(g, terms <= 8 ? terms : terms <= 12 ? 9 : terms <= 16 ? 10 : 11) << terms;
        }
    }
    EXPECT_EQ(items, planner.work().items.size());
    EXPECT_GT(planner.work().groups[11].item_count, 0u) << "the pack should have clusters of more than 16";
}

// w = dim * product of open * product of (1 - open), per channel.
TEST(Planner, WeightsAreProducts) {
    PackData data = test::emptyPack(1, 2);
    data.contributions = {
        {0u, {}, {}, 0, 0}, {0u, {1}, {2}, 0, 0}, {std::nullopt, {}, {1}, 0, 0}, {0u, {1, 2}, {}, 0, 0}};
    data.page_count = 1;
    data.page_width = data.page_height = 8;
    test::Random random(1);
    const test::ClusterPlan plans[] = {{{0, 1, 2, 3}, 5}};
    test::fillPack(data, plans, random);

    Planner planner(data);
    planner.setElement(0, Weight(1, 0.5f, 0.25f));
    planner.setElement(1, 0.5f);
    planner.setElement(2, 0.75f);
    ASSERT_TRUE(planner.plan());
    ASSERT_EQ(planner.work().terms.size(), 4u);
    const float doors[] = {1, 0.5f * 0.25f, 0.5f, 0.5f * 0.75f};
    for (int i = 0; i < 4; ++i) {
        const Weight dim = i == 2 ? Weight(1) : Weight(1, 0.5f, 0.25f);
        const WorkTerm& term = planner.work().terms[static_cast<size_t>(i)];
        const float scale = std::ldexp(doors[i], 100);  // weights of work lists carry 2^100
        EXPECT_EQ(Weight(term.weight_r, term.weight_g, term.weight_b),
                  Weight(dim.r * scale, dim.g * scale, dim.b * scale));
    }
}

TEST(Planner, AfterARollbackTheNextPlanRepeatsTheWork) {
    const PackData data = setsOnly(6);
    Planner planner(data);
    planner.plan();
    planner.setElement(2, 0.5f);
    ASSERT_TRUE(planner.plan());
    const auto lost = recordsRead(planner, data);
    planner.rollback();
    EXPECT_TRUE(planner.work().items.empty());
    ASSERT_TRUE(planner.plan());
    EXPECT_EQ(recordsRead(planner, data), lost);

    // Back to the weights of before too: whether the pages still hold them is not certain.
    planner.setElement(2, 0.25f);
    ASSERT_TRUE(planner.plan());
    planner.rollback();
    planner.setElement(2, 0.5f);
    ASSERT_TRUE(planner.plan());
    EXPECT_EQ(recordsRead(planner, data), lost);
    EXPECT_FALSE(planner.plan());
}

// Nothing changed, or nothing by more than the tolerance, since the plan that is taken back.
TEST(Planner, ARollbackReachesBackPastPlansThatHadNothingToDo) {
    const PackData data = setsOnly(6);
    for (const float tolerance : {0.0f, std::numeric_limits<float>::max()}) {
        Planner planner(data);
        planner.plan();
        planner.setElement(2, 0.5f);
        ASSERT_TRUE(planner.plan());
        const auto lost = recordsRead(planner, data);
        planner.setLimits({.tolerance_quanta = tolerance});
        if (tolerance > 0) planner.setElement(2, 0.75f);
        ASSERT_FALSE(planner.plan());
        planner.rollback();
        ASSERT_TRUE(planner.plan());
        EXPECT_EQ(recordsRead(planner, data), lost);
    }
}

// With limits, what was planned in vain waits: with the weights of now, not with those that came back.
TEST(Planner, AfterARollbackNoStateOfBeforeGoesOn) {
    const PackData data = setsOnly(6);
    for (const UpdateLimits& limits : {UpdateLimits{.receivers_max = 64}, UpdateLimits{.tolerance_quanta = 0.5f}}) {
        Planner planner(data);
        planner.setLimits(limits);
        ASSERT_TRUE(planner.plan());
        planner.rollback();
        EXPECT_TRUE(planner.waiting());
        EXPECT_FALSE(planner.mayGoOn());
        ASSERT_TRUE(planner.plan());
        EXPECT_FALSE(planner.work().terms.empty()) << "everything is on, but was off before";
    }
}

TEST(Planner, AnotherBudgetGoesOnWithWhatWaits) {
    const PackData data = setsOnly(7);
    Planner planner(data);
    planner.setLimits({.receivers_max = 256});
    ASSERT_TRUE(planner.plan());
    for (const uint32_t most : {128u, 512u}) {
        planner.setLimits({.receivers_max = most});
        ASSERT_TRUE(planner.mayGoOn());
        ASSERT_TRUE(planner.planWaiting());
        EXPECT_LE(planner.stats().receivers, most);
        EXPECT_GT(planner.stats().receivers, most - batch_receivers_max) << "room for another batch";
    }
    planner.setLimits({.receivers_max = 512, .tolerance_quanta = 1});
    EXPECT_FALSE(planner.mayGoOn());
    ASSERT_TRUE(planner.plan());
    EXPECT_TRUE(planner.mayGoOn());
    planner.setLimits({.receivers_max = 0, .tolerance_quanta = 1});
    EXPECT_FALSE(planner.mayGoOn()) << "without a limit the next update brings everything as it is now";
}

// Held against a sort of everything that waits, ties and what is taken in parts included.
TEST(Planner, ABudgetTakesTheMostUrgentInOrder) {
    const PackData data = setsOnly(8);
    const std::vector<float> quanta = quantaPerWeight(data);
    struct Waits {
        uint32_t cluster, batches;
        float quanta, plans;
        uint32_t first = 0;  // of the batches that wait, going round
    };
    std::vector<Waits> waits;
    for (uint32_t i = 0; i < data.clusters.size(); ++i) {
        const Cluster& c = data.clusters[i];
        waits.push_back({i, c.batch_count, 0, 1});
        for (uint32_t t = c.first_term; t < c.first_term + c.term_count; ++t) waits.back().quanta += quanta[t];
    }
    Planner planner(data);
    constexpr uint32_t most = 5 * batch_receivers_max;
    planner.setLimits({.receivers_max = most});
    while (!waits.empty()) {
        std::ranges::sort(waits, {}, [](const Waits& w) {
            return std::pair(-(std::min(w.quanta, 1023.0f) + 1) * w.plans * w.plans, w.cluster);
        });
        std::map<uint32_t, uint32_t> expected, taken;  // batches per cluster
        uint32_t left = most;
        for (Waits& w : waits) {
            const Cluster& c = data.clusters[w.cluster];
            if (left < batch_receivers_max) break;
            uint32_t batches = 0;
            while (batches < w.batches) {
                const uint32_t more = data.batches[c.first_batch + (w.first + batches) % c.batch_count].receiver_count;
                if (more > left) break;
                left -= more;
                ++batches;
            }
            w.first += batches;
            expected[w.cluster] = batches;
            w.quanta *= 1 - static_cast<float>(batches) / static_cast<float>(w.batches);
            w.plans = 1;
            w.batches -= batches;
        }
        std::erase_if(waits, [](const Waits& w) { return w.batches == 0; });
        for (Waits& w : waits) ++w.plans;
        ASSERT_TRUE(planner.plan());
        for (const WorkItem& item : planner.work().items) ++taken[item.cluster];
        ASSERT_EQ(taken, expected);
    }
    EXPECT_FALSE(planner.plan());
}

}  // namespace
}  // namespace dimmer
