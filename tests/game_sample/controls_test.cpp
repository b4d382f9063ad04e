// What a person does by hand, and what the panel tells of it.
#include <dimmer/cpu_runtime.h>
#include <game_sample/controls.h>
#include <game_sample/panel.h>
#include <gtest/gtest.h>
#include <pack/sample_pack.h>

#include <algorithm>
#include <limits>

namespace dimmer::sample {
namespace {

// set0 .. set3 with maxima of their own, door0 and door1.
class ControlsTest : public ::testing::Test {
   protected:
    uint32_t set(const char* name) const { return lights_.lightSet(name)->element; }
    uint32_t door(const char* name) const { return lights_.door(name)->element; }
    float openOf(const char* name) const { return lights_.open(*lights_.door(name)); }

    Pack pack_ = *Pack::fromData(test::samplePack());
    CpuRuntime lights_{pack_};
    Controls controls_{lights_};
};

TEST_F(ControlsTest, ATintIsBrightnessTimesColour) {
    const uint32_t set0 = set("set0");  // up to 2
    controls_.setTint(set0, {2, {1, 0.25f, 0}});
    EXPECT_EQ(lights_.weight(LightSet{set0}), Weight(2, 0.5f, 0));
    // As it was set, not as the weight alone would have it.
    controls_.setTint(set0, {1.5f, {0.5f, 0.5f, 0.25f}});
    EXPECT_EQ(controls_.tint(set0).brightness, 1.5f);
    EXPECT_EQ(controls_.tint(set0).color, Weight(0.5f, 0.5f, 0.25f));
    // By somebody else.
    ASSERT_TRUE(lights_.setWeight(LightSet{set0}, {0.5f, 1, 0.25f}));
    EXPECT_EQ(controls_.tint(set0).brightness, 1);
    EXPECT_EQ(controls_.tint(set0).color, Weight(0.5f, 1, 0.25f));
}

TEST_F(ControlsTest, ASetThatIsOffKeepsItsColour) {
    const uint32_t set0 = set("set0");
    ASSERT_TRUE(lights_.setWeight(LightSet{set0}, {1, 0.5f, 0}));
    EXPECT_EQ(controls_.tint(set0).brightness, 1);
    ASSERT_TRUE(lights_.setWeight(LightSet{set0}, 0));
    Tint off = controls_.tint(set0);
    EXPECT_EQ(off.brightness, 0);
    EXPECT_EQ(off.color, Weight(1, 0.5f, 0));
    off.brightness = 0.5f;
    controls_.setTint(set0, off);
    EXPECT_EQ(lights_.weight(LightSet{set0}), Weight(0.5f, 0.25f, 0));
}

TEST_F(ControlsTest, WhatIsBeyondTheMaximumIsCutOff) {
    const uint32_t set0 = set("set0");
    controls_.setTint(set0, {100, {1, 0.001f, 0}});
    EXPECT_EQ(lights_.weight(LightSet{set0}), Weight(2, 0.1f, 0));
}

TEST_F(ControlsTest, ADoorOpensInASecondUnlessSomebodyMovesIt) {
    controls_.send(door("door0"), 1);
    controls_.step(0.25f);
    EXPECT_EQ(openOf("door0"), 0.25f);
    controls_.step(0.25f);
    EXPECT_EQ(openOf("door0"), 0.5f);
    controls_.step(10);
    EXPECT_EQ(openOf("door0"), 1);
    // There and back, then taken by hand.
    controls_.send(door("door0"), 0);
    controls_.step(0.25f);
    EXPECT_EQ(openOf("door0"), 0.75f);
    ASSERT_TRUE(lights_.setDoor(Door{door("door0")}, 0.125f));
    controls_.step(0.25f);
    EXPECT_EQ(openOf("door0"), 0.125f);
    EXPECT_EQ(openOf("door1"), 0);
}

TEST_F(ControlsTest, AllOnIsEachSetsOwnMostAndAtMostOne) {
    controls_.setAll(false);
    for (const char* name : {"set0", "set1", "set2", "set3"}) EXPECT_EQ(lights_.weight(LightSet{set(name)}), Weight(0));
    controls_.setAll(true);
    for (const char* name : {"set0", "set1", "set2", "set3"}) {
        const float most = pack_.elements()[set(name)].max_weight;
        EXPECT_EQ(lights_.weight(LightSet{set(name)}), Weight(std::min(1.0f, most))) << name;
    }
    EXPECT_EQ(openOf("door0"), 0);
}

TEST_F(ControlsTest, ADoorTakesNoNumberThatIsNone) {
    controls_.setOpen(door("door0"), 0.5f);
    controls_.setOpen(door("door0"), std::numeric_limits<float>::quiet_NaN());
    EXPECT_EQ(openOf("door0"), 0.5f);
    controls_.setOpen(door("door0"), 7);
    EXPECT_EQ(openOf("door0"), 1);
    EXPECT_EQ(controls_.target(door("door0")), 1);
    controls_.send(door("door0"), 0);
    controls_.step(0.25f);
    EXPECT_EQ(controls_.target(door("door0")), 0) << "on its way";
}

TEST_F(ControlsTest, TheTextBringsAnotherRuntimeToTheSameState) {
    ASSERT_TRUE(lights_.apply("set0=1.25,set1=0.1/0.2/0.3,set2=0,door:door1=0.7"));
    CpuRuntime other(pack_);
    const std::string text = controls_.text();
    ASSERT_TRUE(other.apply(text)) << text;
    for (uint32_t i = 0; i < pack_.elements().size(); ++i) {
        if (pack_.elements()[i].kind == ElementKind::LightSet)
            EXPECT_EQ(other.weight(LightSet{i}), lights_.weight(LightSet{i})) << text;
        else
            EXPECT_EQ(other.open(Door{i}), lights_.open(Door{i})) << text;
    }
}

TEST(CostHistory, KeepsTheLastChangeAndForgetsNoneOfTheFrames) {
    CostHistory costs;
    EXPECT_FALSE(costs.last_change);
    costs.add({.clusters = 7, .dispatches = 2, .host_us = 40, .gpu_us = 300});
    costs.add({.dispatches = 1, .probes_resampled = 96, .host_us = 20, .gpu_us = 100});
    costs.add({.host_us = 1});
    ASSERT_TRUE(costs.last_change);
    EXPECT_EQ(costs.last_change->clusters, 7u);
    EXPECT_EQ(costs.moving_probes, 0u);
    const size_t n = costs.host_us.size();
    EXPECT_EQ(costs.host_us[n - 3], 40);
    EXPECT_EQ(costs.host_us[n - 1], 1);
    EXPECT_EQ(costs.gpu_us[n - 2], 100);
    EXPECT_EQ(costs.gpu_us[n - 1], 0);
    EXPECT_EQ(costs.host_us[0], 0);
}

}  // namespace
}  // namespace dimmer::sample
