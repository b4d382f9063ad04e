// Light probes: their arithmetic against double, and the device against the CPU.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <format/probe.h>
#include <pipeline/budget.h>
#include <synth/synth.h>
#include <write/pack_writer.h>

#include "exact_light.h"
#include "gpu_fixture.h"
#include "pages.h"

namespace dimmer {
namespace {

using test::packOf;

int signedCode(const ProbeRecord& probe, size_t i) {
    return static_cast<int8_t>(probe.bands[i / 4] >> (8 * (i % 4)));
}

// L_lm of a sum is the sum of the parts' L_lm: with L_lm = L_00 sqrt(2l+1) q / 127 in double.
TEST(ProbeBlend, CoefficientsAddUpWithinHalfAStep) {
    test::Random random(1);
    for (int round = 0; round < 3000; ++round) {
        ProbeBlend<ColorFormat::R11G11B10F> blend;
        std::array<double, 3> light{};
        std::array<double, probe_codes> bands{};
        for (uint32_t terms = test::pick(random, 1, 12); terms > 0; --terms) {
            const ProbeRecord probe = test::randomProbe(random, ColorFormat::R11G11B10F);
            const float w[3] = {test::uniform(random, 0, 2), test::uniform(random, 0, 2), round % 2 ? 1.0f : 0.0f};
            blend.add(probe, w[0] * 0x1p100f, w[1] * 0x1p100f, w[2] * 0x1p100f);
            const auto part = test::decoded(probe.light);
            for (size_t c = 0; c < 3; ++c) light[c] += static_cast<double>(w[c]) * part[c];
            for (size_t i = 0; i < probe_codes; ++i) {
                const double root = std::sqrt(i < 9 ? 3.0 : 5.0);
                bands[i] += static_cast<double>(w[i % 3]) * part[i % 3] * root * signedCode(probe, i) / 127;
            }
        }
        const ProbeRecord sum = blend.encode();
        const auto stored = test::decoded(sum.light);
        for (size_t c = 0; c < 3; ++c) {
            // Below the first number of the format there is only 0.
            const double tolerance =
                light[c] < 0x1p-14 ? 0x1p-14 : 0.51 * test::quantum(light[c], test::channel_mantissa_bits[c]);
            ASSERT_NEAR(stored[c], light[c], tolerance);
        }
        for (size_t i = 0; i < probe_codes; ++i) {
            if (light[i % 3] < 1e-5) continue;  // black: nothing to compare
            const double q = 127 * bands[i] / (light[i % 3] * std::sqrt(i < 9 ? 3.0 : 5.0));
            // Half a step, and 13 roundings of 6e-8 of codes up to 255.
            ASSERT_NEAR(signedCode(sum, i), q, 0.501) << "round " << round << " coefficient " << i;
        }
    }
}

TEST(ProbeBlend, BlackHasNoBands) {
    const ProbeRecord black = ProbeBlend<ColorFormat::R11G11B10F>().encode();
    EXPECT_EQ(black, ProbeRecord{});
    EXPECT_EQ(ProbeBlend<ColorFormat::E5B9G9R9>().encode(), ProbeRecord{});
}

PackData packWithProbes(uint32_t seed, ColorFormat format = ColorFormat::R11G11B10F) {
    PackData data = test::randomPack(seed);
    if (format != data.color_format) {
        test::Random random(seed);
        data.color_format = format;
        for (auto* records : {&data.base_pages, &data.payload})
            for (TexelRecord& record : *records) record.irradiance = test::randomSharedExponent(random);
    }
    test::Random random(seed + 1000);
    test::addRandomProbes(data, random);
    return data;
}

TEST(CpuProbes, HoldTheBaseAndComeBackToIt) {
    const Pack pack = packOf(packWithProbes(1));
    const CpuRuntime untouched(pack);
    for (size_t i = 0; i < pack.data().probes.base.size(); ++i)
        ASSERT_EQ(std::memcmp(&untouched.probes()[7 * i], &pack.data().probes.base[i], 28), 0);
    CpuRuntime runtime(pack);
    runtime.update();
    EXPECT_FALSE(std::ranges::equal(runtime.probes(), untouched.probes()));
    ASSERT_TRUE(runtime.apply("all=0,door:door0=1,door:door1=1,door:door2=1"));
    runtime.update();
    EXPECT_EQ(runtime.update().batches, 0u);
    CpuRuntime fresh(pack);
    test::copyState(runtime, fresh);
    fresh.update();
    EXPECT_TRUE(std::ranges::equal(runtime.probes(), fresh.probes()));
}

TEST(PackProbes, SurviveTheFile) {
    const PackData data = packWithProbes(2);
    const auto pack = Pack::fromBytes(cook::packBytes(data), "test");
    ASSERT_TRUE(pack) << pack.error().message;
    EXPECT_EQ(pack->data().probes.base, data.probes.base);
    EXPECT_EQ(pack->data().probes.payload, data.probes.payload);
    EXPECT_EQ(pack->data().probes.numbers, data.probes.numbers);
    EXPECT_EQ(pack->data().probes.clusters.size(), data.probes.clusters.size());
}

TEST(PackProbes, WhatDoesNotFitTogetherIsRefused) {
    const PackData good = packWithProbes(3);
    ASSERT_TRUE(validate(good));
    const auto refused = [&](auto&& change) {
        PackData data = good;
        change(data.probes);
        const auto ok = validate(data);
        return !ok && ok.error().code == ErrorCode::BadInput;
    };
    EXPECT_TRUE(refused([](ProbeData& p) { p.numbers[3] = static_cast<uint32_t>(p.base.size()); }));
    EXPECT_TRUE(refused([](ProbeData& p) { p.numbers[3] = p.numbers[4]; }));
    EXPECT_TRUE(refused([](ProbeData& p) { p.numbers.pop_back(); }));
    EXPECT_TRUE(refused([](ProbeData& p) { p.payload.pop_back(); }));
    EXPECT_TRUE(refused([](ProbeData& p) { p.record_counts.pop_back(); }));
    EXPECT_TRUE(refused([](ProbeData& p) { ++p.record_counts[0], --p.record_counts[1]; }));
    EXPECT_TRUE(refused([](ProbeData& p) { p.terms[0].contribution = 1000; }));
    EXPECT_TRUE(refused([](ProbeData& p) { ++p.terms[1].first_record; }));
    EXPECT_TRUE(refused([](ProbeData& p) { ++p.clusters[1].receiver_count; }));
    EXPECT_TRUE(refused([](ProbeData& p) { ++p.batches[0].receiver_count; }));
    EXPECT_TRUE(refused([](ProbeData& p) { p.base.clear(); }));
}

TEST(PackProbes, SyntheticLevelsHaveAsManyAsTable1) {
    const auto pack = cook::synthesise(
        {.level = *cook::productionLevel("estate"), .scale = 1.0 / 16, .clusters = 100, .probes = true});
    ASSERT_TRUE(pack);
    EXPECT_EQ(pack->probes.base.size(), 17533u);  // (50805 + 229725) / 16
    EXPECT_TRUE(validate(*pack)) << validate(*pack).error().message;
    EXPECT_NEAR(static_cast<double>(pack->probes.payload.size()) / static_cast<double>(pack->probes.base.size()),
                static_cast<double>(pack->payload.size()) / static_cast<double>(pack->base_pages.size()), 0.02);
}

class GpuProbes : public test::GpuTest {
   protected:
    static void expectEqual(Runtime& gpu, const CpuRuntime& cpu) {
        const auto pages = gpu.readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        ASSERT_TRUE(std::ranges::equal(pages->probes, cpu.probes()));
        ASSERT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages()));
    }
};

TEST_F(GpuProbes, AgreeWithTheCpuBitForBitOverRandomHistories) {
    for (const ColorFormat format : {ColorFormat::R11G11B10F, ColorFormat::E5B9G9R9})
        for (const Buffering buffering : {Buffering::InPlace, Buffering::Double}) {
            const Pack pack = packOf(packWithProbes(4, format));
            Runtime gpu = runtimeOf(pack, {.buffering = buffering});
            CpuRuntime cpu(pack);
            test::Random random(4);
            expectEqual(gpu, cpu);
            for (int step = 0; step < 12; ++step) {
                const auto stats = gpu.submit();
                ASSERT_TRUE(stats) << stats.error().message;
                const UpdateStats expected = cpu.update();
                if (buffering == Buffering::InPlace) {
                    EXPECT_EQ(stats->batches, expected.batches);
                    EXPECT_EQ(stats->bytes_written, expected.bytes_written);
                    EXPECT_EQ(stats->dispatches, expected.dispatches);
                }
                expectEqual(gpu, cpu);
                if (HasFailure()) FAIL() << "step " << step;
                const std::string state = test::randomState(pack.data(), random);
                ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
            }
        }
}

TEST_F(GpuProbes, NothingChangedIsNoSubmission) {
    Runtime gpu = runtimeOf(packOf(packWithProbes(5)));
    ASSERT_TRUE(gpu.submit());
    EXPECT_NE(gpu.probes(0), VkBuffer{VK_NULL_HANDLE});
    const uint64_t value = gpu.semaphoreValue();
    EXPECT_EQ(gpu.submit()->dispatches, 0u);
    EXPECT_EQ(gpu.semaphoreValue(), value);
}

// No texel changes, probes do.
TEST_F(GpuProbes, AloneTheyAreUpdatedToo) {
    PackData data = test::emptyPack(4, 1);
    data.page_count = data.page_width = data.page_height = 1;
    test::Random random(6);
    test::fillPack(data, {}, random);
    test::addRandomProbes(data, random);
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    for (const char* state : {"set0=0.5", "all=0", "door:door0=0.25,set1=1/0/0.5"}) {
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqual(gpu, cpu);
    }
}

TEST_F(GpuProbes, DeviceMemoryIsTheSumThatInspectStates) {
    const PackData data = packWithProbes(7);
    EXPECT_EQ(runtimeOf(packOf(data)).footprint().bytes, cook::costOf(data).device());
}

TEST_F(GpuProbes, AgreeWithTheCpuOnHostileRecords) {
    PackData data = packWithProbes(8);
    test::Random random(8);
    for (auto* records : {&data.probes.base, &data.probes.payload})
        for (ProbeRecord& record : *records) record.light = static_cast<uint32_t>(random());
    data.elements[0].max_weight = 65536;
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    for (const char* state : {"set0=65536", "all=0.0000001,door:door0=0.5"}) {
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqual(gpu, cpu);
        for (size_t i = 0; i < cpu.probes().size(); i += 7)
            for (size_t c = 0; c < 3; ++c)
                ASSERT_LT(test::channelCodes(cpu.probes()[i])[c] >> test::channel_mantissa_bits[c], 31u);
    }
}

}  // namespace
}  // namespace dimmer
