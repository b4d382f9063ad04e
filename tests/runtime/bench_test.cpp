// The figures of `dimmer bench` that do not depend on the machine.
#include <app/bench.h>
#include <gtest/gtest.h>
#include <write/pack_writer.h>

#include "random_pack.h"

#include <nlohmann/json.hpp>
#include <sstream>

namespace dimmer {
namespace {

class BenchTest : public testing::Test {
   protected:
    void SetUp() override {
        pack_ = std::filesystem::path(testing::TempDir()) /
                fmt::format("bench_{}.dimmer", testing::UnitTest::GetInstance()->current_test_info()->name());
        ASSERT_TRUE(cook::writeFileAtomically(pack_, cook::packBytes(data_)));
    }
    void TearDown() override { std::filesystem::remove(pack_); }

    PackData data_ = test::randomPack(1, {.sets = 4, .doors = 1});
    std::filesystem::path pack_;
};

TEST_F(BenchTest, CountsWhatEachCaseTouches) {
    std::ostringstream out;
    const auto done = cook::benchPack({.pack = pack_, .frames = 3, .mode = "cpu", .json = "-", .command = "a b"}, out);
    ASSERT_TRUE(done) << done.error().message;
    const auto json = nlohmann::json::parse(out.str());
    for (const char* key : {"device", "driver", "pack", "command", "cases"}) EXPECT_TRUE(json.contains(key)) << key;
    ASSERT_EQ(json["cases"].size(), 1 + 4 + 1 + 1 + 1u);  // nothing, sets, doors, two sets, all sets

    const auto& nothing = json["cases"][0];
    EXPECT_EQ(nothing["name"], "nothing changed");
    for (const char* key : {"receivers", "batches", "dispatches", "bytes"}) EXPECT_EQ(nothing[key], 0) << key;

    // Every cluster that holds a contribution of set 2, which has a few through doors as well.
    uint32_t batches = 0, receivers = 0;
    for (const Cluster& c : data_.clusters) {
        bool holds = false;
        for (uint32_t t = c.first_term; t < c.first_term + c.term_count; ++t) {
            const Contribution& contribution = data_.contributions[data_.terms[t].contribution];
            // With the doors closed a contribution through an open one has weight 0 either way.
            holds = holds || (contribution.light_set == 2u && contribution.doors_open.empty());
        }
        batches += holds ? (c.receiver_count + 63) / 64 : 0;
        receivers += holds ? c.receiver_count : 0;
    }
    const auto& toggled = json["cases"][3];
    EXPECT_EQ(toggled["name"], "set set2 toggled");
    EXPECT_EQ(toggled["batches"], batches);
    EXPECT_EQ(toggled["receivers"], receivers);
    EXPECT_EQ(json["clock"], "host");
    EXPECT_TRUE(toggled["gpu_us"].is_null()) << "no GPU took part";
    for (const char* spread : {"process_us", "host_us"})
        EXPECT_LE(toggled[spread]["min"].get<double>(), toggled[spread]["max"].get<double>());
}

TEST_F(BenchTest, RefusesWhatItDoesNotKnow) {
    std::ostringstream out;
    EXPECT_EQ(cook::benchPack({.pack = pack_, .mode = "gpu"}, out).error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(cook::benchPack({.pack = pack_, .frames = 0}, out).error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(cook::benchPack({.pack = pack_.string() + ".missing"}, out).error().code, ErrorCode::Io);
    EXPECT_EQ(out.str(), "");
}

}  // namespace
}  // namespace dimmer
