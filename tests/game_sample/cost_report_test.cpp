// Which frames cost what: switches, things that move among lights that rest, and nothing at all.
#include <game_sample/cost_report.h>
#include <gtest/gtest.h>

namespace dimmer::sample {
namespace {

FrameCost frame(uint32_t number, std::vector<std::string> changes, uint32_t batches, uint32_t dispatches,
                double host_us) {
    FrameCost cost{number, std::move(changes), {}};
    cost.stats.contributions_changed = cost.stats.batches = batches;
    cost.stats.dispatches = dispatches;
    cost.stats.host_us = host_us;
    return cost;
}

TEST(SampleCostReport, TellsSwitchesFromThingsThatMove) {
    CostReport report;
    report.add(frame(0, {}, 7, 2, 90));
    report.add(frame(1, {}, 0, 1, 10));  // something moved
    report.add(frame(2, {}, 0, 1, 30));
    report.add(frame(3, {}, 0, 1, 20));
    report.add(frame(4, {"set hall=1"}, 3, 2, 50));
    report.add(frame(5, {}, 0, 0, 2));
    report.add(frame(6, {"set hall=1"}, 0, 0, 1));  // to what it was

    EXPECT_EQ(report.movingFrames().frames, 3u);
    EXPECT_EQ(report.movingFrames().median.host_us, 20);
    EXPECT_EQ(report.unchangedFrames().frames, 1u);
    EXPECT_EQ(report.unchangedFrames().median.host_us, 2);
    const auto events = report.events();
    ASSERT_EQ(events.size(), 3u);
    EXPECT_EQ(events[0].what, "start");
    EXPECT_EQ(events[0].frames, 1u);
    EXPECT_EQ(events[1].what, "set hall=1");
    EXPECT_EQ(events[1].median.host_us, 50);
    EXPECT_EQ(events[2].first_frame, 6u);
}

TEST(SampleCostReport, AFadeIsOneRowWithItsMedian) {
    CostReport report;
    for (uint32_t i = 0; i < 5; ++i) report.add(frame(i, {"fade"}, 1, 1, 10.0 * (i + 1)));
    const auto events = report.events();
    ASSERT_EQ(events.size(), 1u);
    EXPECT_EQ(events[0].frames, 5u);
    EXPECT_EQ(events[0].median.host_us, 30);
}

}  // namespace
}  // namespace dimmer::sample
