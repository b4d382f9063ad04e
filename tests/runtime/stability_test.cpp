// What "stable" means in numbers: sums, fades, drift, order, hostile input; on the CPU, whose bits are the GPU's.
#include <dimmer/cpu_runtime.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exact_light.h"
#include "pages.h"
#include "random_pack.h"

#include <limits>

namespace dimmer {
namespace {

using test::packOf;

// Within one quantum of the output format: half of it is rounding, and 13 additions of floats lose 13 * 6e-8 at most,
// which is nothing beside the other half.
void expectWithinOneQuantum(const CpuRuntime& runtime) {
    const auto exact = test::exactPages(runtime.pack().data(), runtime);
    for (size_t i = 0; i < exact.size(); ++i) {
        const ColorFormat format = runtime.pack().data().color_format;
        const auto blended = test::decoded(runtime.irradiancePages()[i], format);
        const auto step = test::quanta(exact[i], format);
        for (size_t c = 0; c < 3; ++c)
            ASSERT_NEAR(blended[c], exact[i][c], step[c]) << "texel " << i << " channel " << c;
    }
}

struct Stability : testing::TestWithParam<ColorFormat> {
    static Pack packWith(uint32_t seed, test::RandomPackOptions options = {}) {
        options.color_format = GetParam();
        return packOf(test::randomPack(seed, options));
    }
};
INSTANTIATE_TEST_SUITE_P(Formats, Stability, testing::Values(ColorFormat::R11G11B10F, ColorFormat::E5B9G9R9),
                         [](const auto& format) {
                             return format.param == ColorFormat::R11G11B10F ? "R11G11B10F" : "E5B9G9R9";
                         });

// Records span 1e-3 to 1e5 lux; sets 0 and 1 reach a weight of 2; doors are half open.
TEST_P(Stability, PagesAreTheSumOfDecodedPartsWithinOneQuantum) {
    for (uint32_t seed = 1; seed <= 4; ++seed) {
        CpuRuntime runtime(packWith(seed));
        test::Random random(seed);
        for (int step = 0; step < 8; ++step) {
            runtime.update();
            expectWithinOneQuantum(runtime);
            if (testing::Test::HasFailure()) FAIL() << "seed " << seed << " step " << step;
            ASSERT_TRUE(runtime.apply(test::randomState(runtime.pack().data(), random)));
        }
    }
}

// Each step is within one quantum of the exact sum and never below the one before it: what bands there are, are the
// format's own steps. Where channels share an exponent, that is so of the brightest; the others may lose the half of a
// step when steps grow.
TEST_P(Stability, FadesOf4096StepsNeverStepBack) {
    const Pack pack = packWith(31, {.sets = 5, .doors = 1, .clusters = 12, .page_side = 32});
    CpuRuntime runtime(pack);
    ASSERT_TRUE(runtime.apply("all=0,set1=0.3,set2=0.7"));
    runtime.update();
    std::vector<uint32_t> before(runtime.irradiancePages().begin(), runtime.irradiancePages().end());
    constexpr uint32_t steps = 4096;
    for (uint32_t step = 1; step <= steps; ++step) {
        ASSERT_TRUE(runtime.setWeight(LightSet{0}, static_cast<float>(step) / steps));
        runtime.update();
        for (size_t i = 0; i < before.size(); ++i) {
            const auto was = test::decoded(before[i], GetParam());
            const auto is = test::decoded(runtime.irradiancePages()[i], GetParam());
            const bool shared = GetParam() == ColorFormat::E5B9G9R9;
            const double brightest = std::max({is[0], is[1], is[2]});
            for (size_t c = 0; c < 3; ++c) {
                const bool may_lose = shared && is[c] < brightest;
                ASSERT_GE(is[c] + (may_lose ? test::quanta(is, GetParam())[c] / 2 : 0), was[c])
                    << "texel " << i << " step " << step;
            }
        }
        before.assign(runtime.irradiancePages().begin(), runtime.irradiancePages().end());
        if (step % 256 == 0) expectWithinOneQuantum(runtime);
    }
    CpuRuntime off(pack);
    ASSERT_TRUE(off.apply("all=0,set1=0.3,set2=0.7"));
    off.update();
    EXPECT_FALSE(std::ranges::equal(off.irradiancePages(), runtime.irradiancePages())) << "nothing was faded";
}

TEST_P(Stability, AMillionTogglesEndInTheStateOfAFreshRuntime) {
    const Pack pack = packWith(32, {.sets = 12, .doors = 3, .clusters = 8, .overlap_max = 8, .page_side = 32});
    CpuRuntime runtime(pack);
    test::Random random(32);
    test::toggleAtRandom(runtime, random, 1000000, [&] { runtime.update(); });
    runtime.update();
    CpuRuntime fresh(pack);
    test::copyState(runtime, fresh);
    fresh.update();
    EXPECT_TRUE(std::ranges::equal(runtime.irradiancePages(), fresh.irradiancePages()));
    EXPECT_TRUE(std::ranges::equal(runtime.directionPages(), fresh.directionPages()));
}

TEST_P(Stability, TheOrderOfCallsIsNoPartOfTheResult) {
    const Pack pack = packWith(33);
    CpuRuntime forwards(pack), backwards(pack);
    const auto count = static_cast<uint32_t>(pack.elements().size());
    const auto set = [&](CpuRuntime& runtime, uint32_t i) {
        const float value = static_cast<float>(i + 1) / 16;
        if (pack.elements()[i].kind == ElementKind::Door)
            ASSERT_TRUE(runtime.setDoor(Door{i}, value));
        else
            ASSERT_TRUE(runtime.setWeight(LightSet{i}, value));
    };
    for (uint32_t i = 0; i < count; ++i) set(forwards, i);
    forwards.update();
    for (uint32_t i = count; i-- > 0;) {
        set(backwards, i);
        backwards.update();
    }
    EXPECT_TRUE(std::ranges::equal(forwards.irradiancePages(), backwards.irradiancePages()));
    EXPECT_TRUE(std::ranges::equal(forwards.directionPages(), backwards.directionPages()));
}

TEST_P(Stability, TheNumberOfThreadsIsNoPartOfTheResult) {
    // 3,000 batches and more: enough that all threads work.
    const Pack pack = packWith(37, {.clusters = 2500, .page_side = 384});
    CpuRuntime one(pack), four(pack, 4);
    for (const char* state : {"set1=0.5", "all=0.25,door:door0=0.5", "all=0"}) {
        ASSERT_TRUE(one.apply(state) && four.apply(state));
        EXPECT_GT(one.update().batches, 3000u);
        four.update();
        EXPECT_TRUE(std::ranges::equal(one.irradiancePages(), four.irradiancePages()));
        EXPECT_TRUE(std::ranges::equal(one.directionPages(), four.directionPages()));
    }
}

// Clusters and batches in another order are the same light.
TEST_P(Stability, TheOrderOfClustersAndBatchesIsNoPartOfTheResult) {
    const PackData data = test::randomPack(34, {.color_format = GetParam()});
    CpuRuntime a(packOf(data)), b(packOf(test::withClustersReversed(data)));
    for (const char* state : {"set1=0.5", "door:door0=0.5,set3=0.25/1/0"}) {
        ASSERT_TRUE(a.apply(state) && b.apply(state));
        a.update();
        b.update();
        EXPECT_TRUE(std::ranges::equal(a.irradiancePages(), b.irradiancePages()));
        EXPECT_TRUE(std::ranges::equal(a.directionPages(), b.directionPages()));
    }
}

// Denormal weights, weights next to the edges, the largest: whatever is accepted gives finite codes, and the
// exact light where it fits the format.
TEST_P(Stability, WeightsOnTheEdgeGiveFiniteLight) {
    PackData data = test::randomPack(35, {.doors = 1, .color_format = GetParam()});
    data.elements[2].max_weight = max_weight_limit;
    CpuRuntime runtime(packOf(std::move(data)));
    const float one_up = std::nextafter(2.0f, 3.0f), largest = max_weight_limit;
    EXPECT_FALSE(runtime.setWeight(LightSet{0}, one_up));
    for (const float w : {std::numeric_limits<float>::denorm_min(), std::numeric_limits<float>::min(),
                          std::nextafter(2.0f, 0.0f), 2.0f}) {
        ASSERT_TRUE(runtime.setWeight(LightSet{0}, w));
        runtime.update();
        expectWithinOneQuantum(runtime);
    }
    for (const Weight& w : {Weight(largest), Weight(largest, 0, std::numeric_limits<float>::denorm_min())}) {
        ASSERT_TRUE(runtime.setWeight(LightSet{2}, w));
        runtime.update();
        double brightest = 0;
        for (uint32_t code : runtime.irradiancePages()) {
            for (const double value : test::decoded(code, GetParam())) brightest = std::max(brightest, value);
            for (size_t c = 0; c < 3 && GetParam() == ColorFormat::R11G11B10F; ++c)
                ASSERT_LT(test::channelCodes(code)[c] >> test::channel_mantissa_bits[c], 31u) << "infinity or NaN";
        }
        // The largest number that each format has.
        EXPECT_EQ(brightest, GetParam() == ColorFormat::R11G11B10F ? 65024 : 65408);
    }
}

// A set at 0: not one byte of its records is read, while the rest of its clusters is blended as ever.
TEST_P(Stability, ASetAtZeroCostsNoPayload) {
    const Pack pack = packWith(36, {.doors = 0});
    CpuRuntime runtime(pack);
    runtime.update();
    for (uint32_t set = 0; set < 9; ++set) {
        ASSERT_TRUE(runtime.setWeight(LightSet{set}, 0.5f));
        const uint64_t on = runtime.update().bytes_read;
        ASSERT_TRUE(runtime.setWeight(LightSet{set}, 0));
        const uint64_t off = runtime.update().bytes_read;
        EXPECT_EQ(on - off, uint64_t{pack.contributions()[set].receivers} * sizeof(TexelRecord));
        ASSERT_TRUE(runtime.setWeight(LightSet{set}, 1));
        runtime.update();
    }
}

}  // namespace
}  // namespace dimmer
