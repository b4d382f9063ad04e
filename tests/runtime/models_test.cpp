// Moving models: their probes follow them through the global grid.
#include <dimmer/cpu_runtime.h>
#include <dimmer/probe_grid.h>
#include <dimmer/runtime.h>
#include <format/probe.h>
#include <pipeline/budget.h>

#include "gpu_fixture.h"
#include "model_pack.h"
#include "pages.h"

#include <limits>
#include <numbers>
#include <set>

namespace dimmer {
namespace {

using test::packOf;
using test::uniform;

// L_00 of light of `v` from everywhere, that gives pi v lux at exposure 1.
constexpr float dcOf(float v) {
    return v * 3.54490770f;  // sqrt(4 pi)
}

Transform at(float x, float y, float z, float angle = 0) {
    const float c = std::cos(angle), s = std::sin(angle);
    return {{{{c, 0, s, x}, {0, 1, 0, y}, {-s, 0, c, z}}}};
}

Transform randomPlace(test::Random& random) {
    return at(uniform(random, -2, 14), uniform(random, -1, 5), uniform(random, -2, 14), uniform(random, 0, 6));
}

// Brighter with x, from 1 to 13: what interpolation must reproduce.
PackData gradientPack() {
    return test::modelPack(1, 800,
                           [](glm::vec3 p) { return glm::vec3(dcOf((1 + std::clamp(p.x, 0.0f, 12.0f)) / 64)); });
}

TEST(ModelGrid, HasAGradientAndALimit) {
    EXPECT_EQ(modelGrid({0, 0, 0}, {0.2f, 0.2f, 0.2f}).counts, (std::array<uint32_t, 3>{2, 2, 2}));
    EXPECT_EQ(modelGrid({0, 0, 0}, {6, 1.5f, 2}, 1.5f).counts, (std::array<uint32_t, 3>{5, 2, 3}));
    const ModelGrid large = modelGrid({0, 0, 0}, {600, 600, 600}, 1.5f, 64);
    EXPECT_LE(large.probeCount(), 64u);
    EXPECT_GE(large.probeCount(), 27u);
    EXPECT_LE(modelGrid({0, 0, 0}, {std::numeric_limits<float>::infinity(), 1, 1}).probeCount(), 2u * 2 * 64);
}

TEST(Models, AModelIsLitByTheLightWhereItStands) {
    const Pack pack = packOf(gradientPack());
    CpuRuntime runtime(pack, 1, 64);
    const Model model = *runtime.addModel({{-1, 0, -0.5f}, {1, 1, 0.5f}, {3, 2, 2}}, at(4, 1, 6));
    test::Random random(3);
    for (int round = 0; round < 20; ++round) {
        const float x = uniform(random, 2, 10), z = uniform(random, 2, 10), angle = uniform(random, 0, 6);
        ASSERT_TRUE(runtime.moveModel(model, at(x, 1, z, angle)));
        EXPECT_EQ(runtime.update().probes_resampled, 12u);
        const GridSampler sampler(pack, runtime.probes());
        const ModelSlot slot = *runtime.modelSlot(model);
        // A place on the model: x grows along its own axis by the cosine of the turn.
        const float along = uniform(random, -1, 1);
        const float world_x = x + along * std::cos(angle), world_z = z - along * std::sin(angle);
        const float expected = (1 + world_x) * std::numbers::pi_v<float>;
        // Two roundings to 9 bits of numbers up to 13, at a tenth of the light at least: half a per cent.
        EXPECT_NEAR(sampler.sample(slot, {world_x, 1.5f, world_z}, {0, 1, 0})[1], expected, 0.005f * expected);
    }
}

// A person whose soles lie in the floor's plane, where a place may count as below it: the lowest probes stand above.
// Their light is that of where they stand, and the soles have theirs.
TEST(Models, ProbesKeepOffTheFloorThatTheModelStandsOn) {
    const Pack pack = packOf(
        test::modelPack(1, 800, [](glm::vec3 p) { return glm::vec3(dcOf((1 + std::clamp(p.y, 0.0f, 4.0f)) / 64)); }));
    CpuRuntime runtime(pack, 1, 64);
    const Model model = *runtime.addModel({{-0.25f, 0, -0.25f}, {0.25f, 1.8f, 0.25f}, {2, 2, 2}}, at(6, 1, 6));
    runtime.update();
    const ModelSlot slot = *runtime.modelSlot(model);
    const GridSampler sampler(pack, runtime.probes());
    for (const auto& [y, lit_as_at] : {std::pair(1.0f, 1.05f), {1.05f, 1.05f}, {2, 2}, {2.75f, 2.75f}, {2.8f, 2.75f}}) {
        const float expected = (1 + lit_as_at) * std::numbers::pi_v<float>;
        EXPECT_NEAR(sampler.sample(slot, {6, y, 6}, {0, 1, 0})[1], expected, 0.005f * expected) << y;  // as above
    }
    // As far in the world where the model is drawn in centimetres.
    Transform centimetres = at(6, 1, 6);
    for (auto& row : centimetres.rows)
        for (size_t axis = 0; axis < 3; ++axis) row[axis] *= 0.01f;
    const Model large = *runtime.addModel({{-25, 0, -25}, {25, 180, 25}, {2, 2, 2}}, centimetres);
    runtime.update();
    const float sole = (1 + 1.05f) * std::numbers::pi_v<float>;
    EXPECT_NEAR(GridSampler(pack, runtime.probes()).sample(*runtime.modelSlot(large), {6, 1, 6}, {0, 1, 0})[1], sole,
                0.005f * sole);
    // Of a ball of 10 cm no more than a tenth of it.
    const Model ball = *runtime.addModel({{-0.05f, 0, -0.05f}, {0.05f, 0.1f, 0.05f}, {2, 2, 2}}, at(6, 1, 6));
    runtime.update();
    const float expected = (1 + 1.01f) * std::numbers::pi_v<float>;
    EXPECT_NEAR(GridSampler(pack, runtime.probes()).sample(*runtime.modelSlot(ball), {6, 1, 6}, {0, 1, 0})[1], expected,
                0.001f * expected);
}

TEST(Models, FarOutsideTheyHaveTheLightOfTheNearestPoint) {
    const Pack pack = packOf(gradientPack());
    CpuRuntime runtime(pack, 1, 8);
    const Model model = *runtime.addModel({}, at(1e6f, 2, 6));
    runtime.update();
    const float lux = GridSampler(pack, runtime.probes()).sample(*runtime.modelSlot(model), {1e6f, 2, 6}, {0, 1, 0})[0];
    EXPECT_NEAR(lux, 13 * std::numbers::pi_v<float>, 0.005f * lux);
}

TEST(Models, NothingMovedNothingIsTaken) {
    PackData data = gradientPack();
    // Set 0 lights the probes near the left wall, set 1 those near the right one; the box's corners neither.
    test::addLightOnProbes(data, 0, encodeE5B9G9R9(1, 1, 1), [](glm::vec3 p) { return p.x > 0 && p.x < 2; });
    test::addLightOnProbes(data, 1, encodeE5B9G9R9(1, 1, 1), [](glm::vec3 p) { return p.x > 10 && p.x < 12; });
    const Pack pack = packOf(std::move(data));
    CpuRuntime runtime(pack, 1, 64);
    ASSERT_TRUE(runtime.apply("all=0"));
    const Model left = *runtime.addModel({}, at(1, 2, 6)), right = *runtime.addModel({}, at(11, 2, 6));
    EXPECT_EQ(runtime.update().probes_resampled, 16u);
    EXPECT_EQ(runtime.update().dispatches, 0u);
    ASSERT_TRUE(runtime.moveModel(left, at(1, 2, 6)));  // to where it is
    EXPECT_EQ(runtime.update().dispatches, 0u);
    ASSERT_TRUE(runtime.moveModel(left, at(1, 2, 7)));
    EXPECT_EQ(runtime.update().probes_resampled, 8u);
    const auto lux = [&](Model model, float x) {
        const GridSampler sampler(pack, runtime.probes());
        return sampler.sample(*runtime.modelSlot(model), {x, 2, 6}, {0, 1, 0})[0];
    };
    const float dark_left = lux(left, 1), dark_right = lux(right, 11);
    ASSERT_TRUE(runtime.apply("set0=1"));  // only the left one's light
    EXPECT_EQ(runtime.update().probes_resampled, 8u);
    EXPECT_GT(lux(left, 1), 1.5f * dark_left);
    EXPECT_EQ(lux(right, 11), dark_right);
    ASSERT_TRUE(runtime.apply("set1=1"));
    EXPECT_EQ(runtime.update().probes_resampled, 8u);
    EXPECT_GT(lux(right, 11), dark_right);
}

// What one set lights at both ends of a level is one cluster, and nothing of what lies between.
TEST(Models, BetweenTwoPlacesThatChangeNothingIsTaken) {
    PackData data = gradientPack();
    test::addLightOnProbes(data, 0, encodeE5B9G9R9(1, 1, 1), [](glm::vec3 p) { return p.x < 2 || p.x > 10; });
    const Pack pack = packOf(std::move(data));
    CpuRuntime runtime(pack, 1, 64);
    for (const float x : {1.0f, 5.5f, 11.0f}) ASSERT_TRUE(runtime.addModel({}, at(x, 2, 6)));
    runtime.update();
    ASSERT_TRUE(runtime.apply("set0=0"));
    EXPECT_EQ(runtime.update().probes_resampled, 16u);
}

TEST(Models, HandlesAndRangesAreTheirOwn) {
    const Pack pack = packOf(gradientPack());
    CpuRuntime runtime(pack, 1, 4096);
    test::Random random(5);
    std::vector<std::pair<Model, ModelGrid>> models;
    std::vector<Model> removed;
    uint32_t refused = 0;
    for (int round = 0; round < 20000; ++round) {
        if (!models.empty() && test::pick(random, 0, 2) == 0) {
            const size_t i = test::pick(random, 0, static_cast<uint32_t>(models.size()) - 1);
            ASSERT_TRUE(runtime.removeModel(models[i].first));
            removed.push_back(models[i].first);
            models[i] = models.back();
            models.pop_back();
            continue;
        }
        ModelGrid grid;
        for (uint32_t& count : grid.counts) count = test::pick(random, 1, 6);
        if (const auto model = runtime.addModel(grid, randomPlace(random)))
            models.emplace_back(*model, grid);
        else
            refused += model.error().code == ErrorCode::OutOfMemory;
    }
    EXPECT_GT(models.size(), 20u);
    std::set<uint32_t> taken;
    const auto base = static_cast<uint32_t>(pack.data().probes.base.size());
    for (const auto& [model, grid] : models) {
        const auto slot = runtime.modelSlot(model);
        ASSERT_TRUE(slot);
        for (uint32_t i = 0; i < grid.probeCount(); ++i) {
            EXPECT_TRUE(taken.insert(slot->first_probe + i).second) << "two models share a probe";
            EXPECT_GE(slot->first_probe, base);
            EXPECT_LT(slot->first_probe + i, base + 4096);
        }
    }
    for (const Model& model : removed) {
        EXPECT_FALSE(runtime.moveModel(model, {}));
        EXPECT_FALSE(runtime.removeModel(model));
        EXPECT_FALSE(runtime.modelSlot(model));
    }
    // Nothing leaks: once all are gone, a grid that takes the whole room fits.
    for (const auto& [model, grid] : models) ASSERT_TRUE(runtime.removeModel(model));
    EXPECT_TRUE(runtime.addModel({{0, 0, 0}, {1, 1, 1}, {16, 16, 16}}, {}));
    EXPECT_EQ(runtime.addModel({}, {}).error().code, ErrorCode::OutOfMemory);
    EXPECT_GT(refused, 1000u);
    EXPECT_GT(removed.size(), 1000u);
}

TEST(Models, WhatMakesNoSenseIsRefused) {
    const Pack pack = packOf(gradientPack());
    CpuRuntime runtime(pack, 1, 64);
    const auto code = [&](const ModelGrid& grid, const Transform& transform) {
        const auto model = runtime.addModel(grid, transform);
        return model ? std::optional<ErrorCode>() : model.error().code;
    };
    EXPECT_EQ(code({{0, 0, 0}, {1, 1, 1}, {0, 2, 2}}, {}), ErrorCode::InvalidArgument);
    EXPECT_EQ(code({{0, 0, 0}, {1, 1, 1}, {65, 2, 2}}, {}), ErrorCode::InvalidArgument);
    EXPECT_EQ(code({{0, 2, 0}, {1, 1, 1}, {2, 2, 2}}, {}), ErrorCode::InvalidArgument);
    EXPECT_EQ(code({{0, 0, 0}, {1, std::numeric_limits<float>::infinity(), 1}, {2, 2, 2}}, {}),
              ErrorCode::InvalidArgument);
    EXPECT_EQ(code({}, at(NAN, 0, 0)), ErrorCode::InvalidArgument);
    EXPECT_EQ(code({}, {{{{1, 0, 0, 0}, {0, 1, 0, 0}, {1, 1, 0, 0}}}}), ErrorCode::InvalidArgument);
    const Model model = *runtime.addModel({}, {});
    EXPECT_EQ(runtime.moveModel(model, at(std::numeric_limits<float>::infinity(), 0, 0)).error().code,
              ErrorCode::InvalidArgument);
    EXPECT_EQ(runtime.moveModel({7, 0}, {}).error().code, ErrorCode::InvalidArgument);
    // A pack without a grid.
    CpuRuntime other(packOf(test::randomPack(1)), 1, 64);
    EXPECT_EQ(other.addModel({}, {}).error().code, ErrorCode::Unsupported);
    CpuRuntime none(pack);
    EXPECT_EQ(none.addModel({}, {}).error().code, ErrorCode::OutOfMemory);
}

// Scaled until the way back is no float any more, and boxes as small.
TEST(Models, OfNextToNoSizeHaveSlotsOfNumbers) {
    const Pack pack = packOf(gradientPack());
    CpuRuntime runtime(pack, 1, 64);
    const auto scaled = [](float s, float x) { return Transform{{{{s, 0, 0, x}, {0, s, 0, 0}, {0, 0, s, 0}}}}; };
    const Model model = *runtime.addModel({}, {});
    const auto expectFinite = [&](Model of, const char* what) {
        const ModelSlot slot = *runtime.modelSlot(of);
        for (const auto& row : slot.grid_from_world)
            for (const float v : row) EXPECT_TRUE(std::isfinite(v)) << what << " " << v;
    };
    for (const float x : {0.0f, 5.0f, 3e38f}) {
        for (const float s : {1e-39f, -1e-39f, 1e-45f, 1e-20f, 1e-37f, 1e38f}) {
            const auto added = runtime.addModel({}, scaled(s, x));
            ASSERT_TRUE(added);
            expectFinite(*added, "added");
            ASSERT_TRUE(runtime.removeModel(*added));
            ASSERT_TRUE(runtime.moveModel(model, scaled(s, x)));
            expectFinite(model, "moved");
            runtime.update();
        }
        const auto speck = runtime.addModel({{0, 0, 0}, {1e-39f, 1e-39f, 1e-39f}, {2, 2, 2}}, scaled(1, x));
        ASSERT_TRUE(speck);
        expectFinite(*speck, "speck");
        ASSERT_TRUE(runtime.removeModel(*speck));
    }
    // All of it is its first probe, whose light is that of the place: x = 5, (1 + 5) pi lux.
    ASSERT_TRUE(runtime.moveModel(model, scaled(1e-39f, 5)));
    runtime.update();
    const GridSampler sampler(pack, runtime.probes());
    const float expected = 6 * std::numbers::pi_v<float>;  // to half a per cent: see above
    EXPECT_NEAR(sampler.sample(*runtime.modelSlot(model), {5, 0, 0}, {0, 1, 0})[1], expected, 0.005f * expected);
}

// Corners that are no numbers (infinity less infinity): the walk takes them for the lower end of the grid, and so must
// whoever asks which models a change of light concerns.
TEST(Models, WhoseCornersAreNoNumbersFollowTheLightWhereTheyAreTaken) {
    PackData data = gradientPack();
    test::addLightOnProbes(data, 0, encodeE5B9G9R9(9, 9, 9), [](glm::vec3 p) { return p.x < 3; });
    const Pack pack = packOf(std::move(data));
    CpuRuntime runtime(pack, 1, 64), fresh(pack, 1, 64);
    const ModelGrid flat{{10, 10, 0}, {10, 10, 1}, {1, 1, 2}};
    const Transform beyond{{{{3e38f, -3e38f, 0, 0}, {0, 1, 0, -8}, {0, 0, 1, 2}}}};
    const Model model = *runtime.addModel(flat, beyond);
    runtime.update();
    for (CpuRuntime* either : {&runtime, &fresh}) ASSERT_TRUE(either->apply("set0=0.5"));
    const Model again = *fresh.addModel(flat, beyond);
    EXPECT_EQ(runtime.update().probes_resampled, 2u);
    fresh.update();
    const uint32_t first = runtime.modelSlot(model)->first_probe;
    ASSERT_EQ(first, fresh.modelSlot(again)->first_probe);
    constexpr size_t words = sizeof(ProbeRecord) / sizeof(uint32_t);
    const auto lightOf = [&](const CpuRuntime& of) { return of.probes().subspan(words * first, 2 * words); };
    EXPECT_TRUE(std::ranges::equal(lightOf(runtime), lightOf(fresh)));
}

TEST(Models, APackWithoutAGridKeepsNoRoomForThem) {
    test::Random random(4);
    PackData data = test::randomPack(4);
    test::addRandomProbes(data, random);
    const Pack pack = packOf(std::move(data));
    CpuRuntime runtime(pack, 1, 4096);
    EXPECT_EQ(runtime.probes().size(), CpuRuntime(pack).probes().size());
    EXPECT_EQ(runtime.addModel({}, {}).error().code, ErrorCode::Unsupported);
}

using GpuModels = test::GpuTest;

TEST_F(GpuModels, APackWithoutAGridKeepsNoRoomForThem) {
    test::Random random(4);
    PackData with_probes = test::randomPack(4);
    test::addRandomProbes(with_probes, random);
    PackData still = test::randomPack(5, {.clusters = 0});  // nothing in it changes
    still.contributions.clear();
    for (PackData* data : {&with_probes, &still}) {
        const Pack pack = packOf(std::move(*data));
        const DeviceFootprint without = runtimeOf(pack, {.buffering = Buffering::Double}).footprint();
        const DeviceFootprint with =
            runtimeOf(pack, {.buffering = Buffering::Double, .moving_probes_max = 4096}).footprint();
        EXPECT_EQ(with.bytes, without.bytes);
        EXPECT_EQ(with.pipelines, without.pipelines);
    }
}

// Random light with directions and visibility, as far from smooth as a grid can be.
PackData wildPack(uint32_t seed, ColorFormat format) {
    PackData data = gradientPack();
    data.color_format = format;
    test::Random random(seed);
    for (ProbeRecord& probe : data.probes.base) probe = test::randomProbe(random, format);
    for (auto* records : {&data.base_pages, &data.payload})
        for (TexelRecord& record : *records) record = test::randomRecord(random, data.exposure, format);
    for (const Tetrahedron& t : data.probes.global.tetrahedra) {
        TetrahedronVisibility& seen = data.probes.global.visibility.emplace_back();
        for (auto& probe : seen.seen)
            for (int8_t& value : probe) value = static_cast<int8_t>(test::pick(random, 0, 255));
        (void)t;
    }
    const uint32_t light = test::randomRecord(random, data.exposure, format).irradiance;
    test::addLightOnProbes(data, 0, light, [](glm::vec3 p) { return p.x < 5; });
    test::addLightOnProbes(data, 1, light, [](glm::vec3 p) { return p.x >= 5 && p.z > 4; });
    return data;
}

TEST_F(GpuModels, MoreRoomThanThereIsIsRefused) {
    const Pack pack = packOf(wildPack(7, ColorFormat::E5B9G9R9));
    const auto refused = Runtime::create(device().context(), pack, {.moving_probes_max = moving_probes_limit + 1});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("16777216 are the most"));
}

// 160 models of 64 probes that wander while the light changes: 10,240 probes taken each time.
TEST_F(GpuModels, AgreeWithTheCpuBitForBit) {
    for (const auto format : {ColorFormat::E5B9G9R9, ColorFormat::R11G11B10F})
        for (const auto buffering : {Buffering::InPlace, Buffering::Double}) {
            const Pack pack = packOf(wildPack(7, format));
            Runtime gpu = runtimeOf(pack, {.buffering = buffering, .moving_probes_max = 10240});
            CpuRuntime cpu(pack, 1, 10240);
            test::Random random(11);
            std::vector<Model> models;
            const auto both = [&](auto&& act) {
                act(static_cast<LightState&>(gpu));
                act(static_cast<LightState&>(cpu));
            };
            for (int i = 0; i < 160; ++i) {
                const Transform place = randomPlace(random);
                const ModelGrid grid{{-1, -1, -1}, {1, 1, 1}, {4, 4, 4}};
                both([&](LightState& state) { models.push_back(*state.addModel(grid, place)); });
                models.pop_back();
            }
            for (int round = 0; round < 4; ++round) {
                for (const Model& model : models) {
                    const Transform place = randomPlace(random);
                    both([&](LightState& state) { ASSERT_TRUE(state.moveModel(model, place)); });
                }
                const float weight = uniform(random, 0, 1);
                both([&](LightState& state) { ASSERT_TRUE(state.setWeight(LightSet{0}, weight)); });
                const auto stats = gpu.submit();
                ASSERT_TRUE(stats);
                EXPECT_EQ(stats->probes_resampled, cpu.update().probes_resampled);
                const auto pages = gpu.readPages();
                ASSERT_TRUE(pages);
                ASSERT_EQ(pages->probes.size(), cpu.probes().size());
                EXPECT_TRUE(std::ranges::equal(pages->probes, cpu.probes())) << "round " << round;
            }
            EXPECT_EQ(gpu.submit()->dispatches, 0u);
        }
}

// In the caller's command buffer too, one dispatch for all; the memory is what the sizes say.
TEST_F(GpuModels, OneDispatchForAllThatMoved) {
    const Pack pack = packOf(wildPack(9, ColorFormat::E5B9G9R9));
    Runtime gpu = runtimeOf(pack, {.moving_probes_max = 4096});
    ASSERT_TRUE(gpu.submit());
    for (int i = 0; i < 64; ++i) ASSERT_TRUE(gpu.addModel({{-1, -1, -1}, {1, 1, 1}, {4, 4, 4}}, at(6, 2, 0.1f * i)));
    const auto stats = gpu.submit();
    EXPECT_EQ(stats->dispatches, 1u);
    EXPECT_EQ(stats->probes_resampled, 4096u);
    // Behind inspect's sum: 28 bytes a probe, a hint of 4, and 64 bytes for every 8 in the work list.
    const uint64_t without = runtimeOf(pack, {}).footprint().bytes;
    EXPECT_EQ(without, cook::costOf(pack.data()).device());
    EXPECT_EQ(gpu.footprint().bytes, without + 4096 * (28 + 4 + 8));
}

}  // namespace
}  // namespace dimmer
