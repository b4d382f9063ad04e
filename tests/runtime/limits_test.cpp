// What updates may leave for later, and that nothing is left for ever.
#include <dimmer/cpu_runtime.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exact_light.h"
#include "pages.h"

#include <limits>

namespace dimmer {
namespace {

using test::packOf;

CpuRuntime freshLike(const CpuRuntime& runtime) {
    CpuRuntime fresh(runtime.pack());
    test::copyState(runtime, fresh);
    fresh.update();
    return fresh;
}

bool samePages(const CpuRuntime& a, const CpuRuntime& b) {
    return std::ranges::equal(a.irradiancePages(), b.irradiancePages()) &&
           std::ranges::equal(a.directionPages(), b.directionPages());
}

uint32_t lightCode(double value) {
    return test::floorUfloatCode(value, 6) | test::floorUfloatCode(value, 6) << 11 |
           test::floorUfloatCode(value, 5) << 22;
}

TEST(UpdateLimits, ABudgetIsKeptAndTheExactStateIsReached) {
    const Pack pack = packOf(test::randomPack(51));
    const auto receivers = static_cast<uint32_t>(pack.data().addresses.size());
    for (const uint32_t budget : {64u, 200u, 1000u}) {
        CpuRuntime runtime(pack);
        ASSERT_TRUE(runtime.setLimits({.receivers_max = budget}));
        uint32_t updates = 0;
        UpdateStats stats;
        do {
            stats = runtime.update();
            EXPECT_LE(stats.receivers, budget);
            EXPECT_GT(stats.receivers, 0u);
            ASSERT_LT(++updates, 2 * receivers);
        } while (stats.receivers_waiting > 0);
        EXPECT_TRUE(samePages(runtime, freshLike(runtime)));
        // Batches may be all but empty, so the limit may not be used up; but it cannot be beaten.
        EXPECT_GE(updates, receivers / budget);
        EXPECT_EQ(runtime.update().batches, 0u);
    }
}

TEST(UpdateLimits, ABudgetOfLessThanABatchStillGetsThere) {
    const Pack pack = packOf(test::randomPack(52, {.clusters = 10}));
    CpuRuntime runtime(pack);
    ASSERT_TRUE(runtime.setLimits({.receivers_max = 1}));
    size_t updates = 0;
    while (runtime.update().batches > 0) ASSERT_LE(++updates, pack.data().batches.size());
    EXPECT_EQ(updates, pack.data().batches.size());
    EXPECT_TRUE(samePages(runtime, freshLike(runtime)));
}

// All the while the state changes; when it rests, the pages arrive. Every cluster was written in the meantime too: what
// changes little is not passed over for ever by what changes much.
TEST(UpdateLimits, UnderConstantChangeNothingStarves) {
    const Pack pack = packOf(test::randomPack(53, {.sets = 6, .doors = 0, .clusters = 30}));
    CpuRuntime runtime(pack);
    const CpuRuntime base(pack);
    ASSERT_TRUE(runtime.setLimits({.receivers_max = 256}));
    test::Random random(53);
    std::vector<bool> seen(base.irradiancePages().size());
    for (uint32_t frame = 0; frame < 400; ++frame) {
        ASSERT_TRUE(runtime.apply(test::randomState(pack.data(), random)));
        runtime.update();
        for (size_t i = 0; i < seen.size(); ++i)
            seen[i] = seen[i] || runtime.irradiancePages()[i] != base.irradiancePages()[i];
    }
    // Black records and those far below their base never show.
    CpuRuntime full(pack);
    full.update();
    for (size_t i = 0; i < seen.size(); ++i) {
        if (full.irradiancePages()[i] == base.irradiancePages()[i]) continue;
        EXPECT_TRUE(seen[i]) << "texel " << i;
    }
    while (runtime.update().batches > 0) {
    }
    EXPECT_TRUE(samePages(runtime, freshLike(runtime)));
}

// Two clusters larger than the limit change by all they can in every frame, two of a batch each changed a little, once.
TEST(UpdateLimits, WhatFlickersLeavesRoomForWhatChangedOnce) {
    PackData data = test::emptyPack(4, 0);
    data.page_count = 1;
    data.page_width = data.page_height = 128;
    test::Random random(56);
    const test::ClusterPlan plans[] = {{{0}, 6400}, {{1}, 6400}, {{2}, 64}, {{3}, 64}};
    test::fillPack(data, plans, random);
    const Pack pack = packOf(std::move(data));
    CpuRuntime runtime(pack);
    ASSERT_TRUE(runtime.apply("all=0"));
    runtime.update();
    const std::vector<uint32_t> dark(runtime.irradiancePages().begin(), runtime.irradiancePages().end());
    ASSERT_TRUE(runtime.setLimits({.receivers_max = 2048}));
    ASSERT_TRUE(runtime.apply("set2=0.01,set3=0.01"));
    const CpuRuntime wanted = freshLike(runtime);
    const PackData& d = pack.data();
    std::vector<bool> flickered(d.addresses.size());
    for (uint32_t frame = 0; frame < 60; ++frame) {
        ASSERT_TRUE(runtime.apply(frame % 2 ? "set0=0.5,set1=0.5" : "set0=1,set1=1"));
        EXPECT_LE(runtime.update().receivers, 2048u);
        for (uint32_t i = 0; i < 12800; ++i)
            if (runtime.irradiancePages()[test::texelOf(d, i)] != dark[test::texelOf(d, i)]) flickered[i] = true;
    }
    for (uint32_t i = 12800; i < 12928; ++i)
        EXPECT_EQ(runtime.irradiancePages()[test::texelOf(d, i)], wanted.irradiancePages()[test::texelOf(d, i)]) << i;
    CpuRuntime dimmed(pack);  // where half of a record does not show, no frame need show it
    ASSERT_TRUE(dimmed.apply("all=0,set0=0.5,set1=0.5"));
    dimmed.update();
    for (uint32_t i = 0; i < 12800; ++i)
        EXPECT_TRUE(flickered[i] || dimmed.irradiancePages()[test::texelOf(d, i)] == dark[test::texelOf(d, i)]) << i;
}

TEST(UpdateLimits, TheMostVisibleComesFirst) {
    // Two clusters of a batch each on the same base; set 1 adds a thousand times what set 0 does.
    PackData data = test::emptyPack(2, 0);
    data.page_count = 1;
    data.page_width = data.page_height = 16;
    test::Random random(54);
    const test::ClusterPlan plans[] = {{{0}, 64}, {{1}, 64}};
    test::fillPack(data, plans, random);
    const auto light = [](double value) { return TexelRecord{lightCode(value), 1023u | 512u << 10 | 512u << 20}; };
    for (TexelRecord& record : data.base_pages) record = light(1);
    for (uint32_t i = 0; i < 128; ++i) data.payload[i] = light(i < 64 ? 0.125 : 125);
    CpuRuntime runtime(packOf(std::move(data)));
    ASSERT_TRUE(runtime.setLimits({.receivers_max = 64}));
    runtime.update();
    const PackData& d = runtime.pack().data();
    EXPECT_EQ(test::decoded(runtime.irradiancePages()[test::texelOf(d, 64)])[0], 126);
    EXPECT_EQ(test::decoded(runtime.irradiancePages()[test::texelOf(d, 0)])[0], 1);
    runtime.update();
    EXPECT_EQ(test::decoded(runtime.irradiancePages()[test::texelOf(d, 0)])[0], 1.125);
}

// Whatever is put off is within the tolerance of the exact sum, however many small changes came before.
TEST(UpdateLimits, AToleranceNeverDrifts) {
    PackData data = test::randomPack(55, {.sets = 6, .doors = 1, .clusters = 20});
    test::Random records(55);
    // No black base: there the first step of the format is infinitely many.
    for (TexelRecord& record : data.base_pages) record.irradiance = lightCode(test::uniform(records, 10, 1000));
    for (TexelRecord& record : data.payload) record.irradiance = lightCode(test::uniform(records, 1, 100));
    const Pack pack = packOf(std::move(data));
    for (const float tolerance : {0.5f, 4.0f}) {
        CpuRuntime runtime(pack);
        ASSERT_TRUE(runtime.apply("all=0.5"));
        ASSERT_TRUE(runtime.setLimits({.tolerance_quanta = tolerance}));
        runtime.update();
        uint64_t put_off = 0;
        test::Random random(55);
        float weight = 0.5f;
        for (uint32_t step = 0; step < 300; ++step) {
            weight += 1e-4f;
            ASSERT_TRUE(runtime.setWeight(LightSet{step % 6}, weight));
            put_off += runtime.update().clusters_put_off;
            if (step % 20 != 0) continue;
            const auto exact = test::exactPages(pack.data(), runtime);
            for (size_t i = 0; i < exact.size(); ++i) {
                const auto held = test::decoded(runtime.irradiancePages()[i]);
                for (size_t c = 0; c < 3; ++c)
                    // What is put off, and half a step for rounding; 1 % for the floats in which it is counted.
                    ASSERT_NEAR(held[c], exact[i][c],
                                (1.01 * static_cast<double>(tolerance) + 0.5) *
                                    test::quantum(exact[i][c], test::channel_mantissa_bits[c]))
                        << "texel " << i << " step " << step;
            }
        }
        EXPECT_GT(put_off, 0u) << "nothing was ever put off";
        EXPECT_FALSE(samePages(runtime, freshLike(runtime)));
        ASSERT_TRUE(runtime.setLimits({}));
        runtime.update();
        EXPECT_TRUE(samePages(runtime, freshLike(runtime)));
    }
}

TEST(UpdateLimits, BudgetAndToleranceTogetherArriveAfterAnyHistory) {
    const Pack pack = packOf(test::randomPack(56));
    CpuRuntime runtime(pack);
    test::Random random(56);
    for (int step = 0; step < 300; ++step) {
        if (step % 10 == 0) {
            ASSERT_TRUE(runtime.setLimits({.receivers_max = test::pick(random, 0, 3) * 100,
                                           .tolerance_quanta = static_cast<float>(test::pick(random, 0, 2))}));
        }
        ASSERT_TRUE(runtime.apply(test::randomState(pack.data(), random)));
        runtime.update();
    }
    ASSERT_TRUE(runtime.setLimits({}));
    runtime.update();
    EXPECT_TRUE(samePages(runtime, freshLike(runtime)));
}

TEST(UpdateLimits, AToleranceThatIsNoNumberIsRefused) {
    CpuRuntime runtime(packOf(test::randomPack(57)));
    for (const float bad : {-1.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
        EXPECT_EQ(runtime.setLimits({.tolerance_quanta = bad}).error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace dimmer
