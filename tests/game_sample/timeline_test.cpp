#include <dimmer/cpu_runtime.h>
#include <game_sample/timeline.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/pack_data.h>

#include <fmt/format.h>

#include <set>

namespace dimmer::sample {
namespace {

class TimelineTest : public ::testing::Test {
   protected:
    static Pack makePack() {
        PackData data;
        data.page_width = data.page_height = 8;
        data.page_count = 1;
        data.base_pages.resize(64);
        data.elements = {{"hall", ElementKind::LightSet, 1}, {"front", ElementKind::Door, 1}};
        return *Pack::fromData(std::move(data));
    }

    // Plays frames 0..`last`; `seen(frame)` after each.
    template <class Seen>
    void play(std::string_view text, uint32_t last, Seen seen) {
        const auto script = parseScript(text, "test", pack_);
        ASSERT_TRUE(script) << script.error().message;
        Timeline timeline(*script);
        for (uint32_t frame = 0; frame <= last; ++frame) {
            const auto changes = timeline.advance(frame, lights_);
            ASSERT_TRUE(changes) << changes.error().message;
            seen(frame, timeline, *changes);
        }
    }

    Weight hall() const { return lights_.weight(*lights_.lightSet("hall")); }

    Pack pack_ = makePack();
    CpuRuntime lights_{pack_};
};

TEST_F(TimelineTest, SetTakesEffectInItsFrameAndIsReportedOnce) {
    play("at 2 set hall=0.25", 4, [&](uint32_t frame, const Timeline&, const auto& changes) {
        EXPECT_EQ(hall(), Weight(frame < 2 ? 1.0f : 0.25f));
        EXPECT_EQ(changes.size(), frame == 2 ? 1u : 0u);
    });
}

TEST_F(TimelineTest, FadeIsLinearPerChannelAndEndsExactly) {
    play("at 1 fade hall 1 0/0.5/1 over 4", 7, [&](uint32_t frame, const Timeline&, const auto& changes) {
        const float t = frame <= 1 ? 0 : frame >= 5 ? 1 : static_cast<float>(frame - 1) / 4;
        EXPECT_EQ(hall(), Weight(1 - t, 1 - t / 2, 1)) << frame;
        EXPECT_EQ(changes.size(), frame >= 1 && frame <= 5 ? 1u : 0u) << frame;
    });
}

TEST_F(TimelineTest, DoorsFadeToo) {
    play("at 0 fade door:front 0 1 over 2", 2, [&](uint32_t frame, const Timeline&, const auto&) {
        EXPECT_EQ(lights_.open(*lights_.door("front")), static_cast<float>(frame) / 2);
    });
}

TEST_F(TimelineTest, FlickerStaysWithinItsRangeOfTheWeightAndGivesItBack) {
    std::set<float> reds;
    play("at 0 set hall=0.8/0.4/0\nat 1 flicker hall 0.25 0.75 for 20 seed 3", 25,
         [&](uint32_t frame, const Timeline&, const auto&) {
             if (frame == 0 || frame > 20) {
                 EXPECT_EQ(hall(), Weight(0.8f, 0.4f, 0));
                 return;
             }
             EXPECT_GE(hall().r, 0.8f * 0.25f);
             EXPECT_LE(hall().r, 0.8f * 0.75f);
             EXPECT_FLOAT_EQ(hall().g, hall().r / 2);
             EXPECT_EQ(hall().b, 0);
             reds.insert(hall().r);
         });
    EXPECT_GT(reds.size(), 15u);
}

// A lamp that is shot out while it flickers or fades stays dark, and of two fades the earlier does not come back.
TEST_F(TimelineTest, ALaterCommandEndsWhatRunsThere) {
    for (const char* running : {"flicker hall 0.5 1 for 20 seed 3", "fade hall 1 0.5 over 20"})
        for (const char* shot : {"set hall=0", "set door:front=1, hall =0", "set \"door: front=1,hall\t=0\"",
                                 "set all=0", "fade hall 0 0 over 2"}) {
            SCOPED_TRACE(shot);
            play(fmt::format("at 1 {}\nat 5 {}", running, shot), 30,
                 [&](uint32_t frame, const Timeline&, const auto& changes) {
                     EXPECT_EQ(frame >= 5, hall() == Weight(0)) << frame;
                     if (frame == 1 || frame == 4) {
                         EXPECT_EQ(changes.size(), 1u);
                     } else if (frame > 7) {
                         EXPECT_TRUE(changes.empty());
                     }
                 });
            lights_.apply("all=1,door:front=0").value();
        }
    play("at 0 fade door:front 0 1 over 10\nat 5 set all=0", 10, [&](uint32_t frame, const Timeline&, const auto&) {
        EXPECT_EQ(lights_.open(*lights_.door("front")), static_cast<float>(frame) / 10);  // no set
    });
}

// What it gives back is what the first one found, not what that had made of it.
TEST_F(TimelineTest, AFlickerThatFollowsAnotherGivesBackTheSameWeight) {
    play("at 1 flicker hall 0.2 0.4 for 20 seed 1\nat 5 flicker hall 0.5 0.6 for 10 seed 2", 20,
         [&](uint32_t frame, const Timeline&, const auto&) {
             if (frame >= 5) {
                 EXPECT_GE(hall().r, frame < 15 ? 0.5f : 1.0f) << frame;
             }
         });
}

TEST_F(TimelineTest, FlickerNoiseIsUniformAndDependsOnItsSeed) {
    double sum = 0;
    int differing = 0;
    for (uint32_t frame = 0; frame < 4096; ++frame) {
        const float noise = flickerNoise(7, frame);
        ASSERT_GE(noise, 0);
        ASSERT_LT(noise, 1);
        sum += noise;
        differing += noise != flickerNoise(8, frame);
    }
    // The mean of 4096 uniform numbers has a standard deviation of 1 / sqrt(12 * 4096) = 0.0045.
    EXPECT_NEAR(sum / 4096, 0.5, 5 * 0.0045);
    EXPECT_GT(differing, 4000);
}

TEST_F(TimelineTest, CamerasCutAndMove) {
    std::vector<float> xs;
    CameraPose last;
    play("camera 0 0 0 look 1 0 0\nat 1 move 8 0 0 look 9 0 0 over 4\nat 7 camera 3 3 3 look 3 4 3", 8,
         [&](uint32_t frame, const Timeline& timeline, const auto&) {
             xs.push_back(timeline.camera().position_m.x);
             last = timeline.camera();
             EXPECT_EQ(timeline.cut(), frame == 7);
         });
    // 8 (3t^2 - 2t^3) at t = 0, 1/4, 1/2, 3/4, 1
    EXPECT_THAT(xs,
                testing::Pointwise(testing::FloatNear(1e-5f), std::vector<float>{0, 0, 1.25f, 4, 6.75f, 8, 8, 3, 3}));
    EXPECT_EQ(last.forward, glm::vec3(0, 1, 0));
}

}  // namespace
}  // namespace dimmer::sample
