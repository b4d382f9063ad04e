#include <dimmer/cpu_runtime.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "random_pack.h"

#include <limits>

namespace dimmer {
namespace {

using testing::HasSubstr;

// Sets hall (to 1), alarm (to 2) and porch (to 1), doors front and porch.
Pack smallPack() {
    PackData data;
    data.page_count = data.page_width = data.page_height = 1;
    data.base_pages.resize(1);
    data.elements = {{"hall", ElementKind::LightSet, 1},
                     {"alarm", ElementKind::LightSet, 2},
                     {"porch", ElementKind::LightSet, 1},
                     {"front", ElementKind::Door, 1},
                     {"porch", ElementKind::Door, 1}};
    auto pack = Pack::fromData(std::move(data));
    if (!pack) throw std::runtime_error(pack.error().message);
    return *pack;
}

class LightStateTest : public testing::Test {
   protected:
    LightSet set(const char* name) { return *state.lightSet(name); }
    Door door(const char* name) { return *state.door(name); }
    Weight weightOf(const char* name) { return state.weight(set(name)); }
    void expectAsAtTheStart() {
        for (const char* name : {"hall", "alarm", "porch"}) EXPECT_EQ(weightOf(name), Weight(1)) << name;
        for (const char* name : {"front", "porch"}) EXPECT_EQ(state.open(door(name)), 0) << name;
    }

    CpuRuntime state{smallPack()};
};

TEST_F(LightStateTest, StartsWithEverySetAtOneAndEveryDoorClosed) {
    expectAsAtTheStart();
}

TEST_F(LightStateTest, SetsAndDoorsHaveSeparateNames) {
    ASSERT_TRUE(state.setDoor(door("porch"), 0.25f));
    ASSERT_TRUE(state.setWeight(set("porch"), 0.5f));
    EXPECT_EQ(state.open(door("porch")), 0.25f);
    EXPECT_EQ(weightOf("porch"), Weight(0.5f));
}

TEST_F(LightStateTest, AnUnknownNameSuggestsTheNearest) {
    const auto unknown = state.lightSet("hal");
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().code, ErrorCode::NotFound);
    EXPECT_THAT(unknown.error().message, HasSubstr("\"hal\""));
    EXPECT_THAT(unknown.error().message, HasSubstr("\"hall\""));
    EXPECT_THAT(state.door("frnt").error().message, HasSubstr("\"front\""));
    // Far from everything: no suggestion; of the other kind: say so.
    EXPECT_THAT(state.lightSet("zzzzzzzz").error().message, Not(HasSubstr("mean")));
    EXPECT_THAT(state.lightSet("front").error().message, HasSubstr("door:front"));
}

// As printf() writes them, down to what is no float any more.
TEST_F(LightStateTest, NumbersOfATextAreThoseThatProgramsPrint) {
    ASSERT_TRUE(state.apply("hall=+0.5,alarm=1e-50,door:front=+1.0e-1"));
    EXPECT_EQ(weightOf("hall"), Weight(0.5f));
    EXPECT_EQ(weightOf("alarm"), Weight(0));
    EXPECT_EQ(state.open(door("front")), 0.1f);
    for (const char* bad : {"hall=+-0.5", "hall=++1", "hall=+", "hall=1e60", "hall=1e999", "hall=0.5x"})
        EXPECT_FALSE(state.apply(bad)) << bad;
    EXPECT_EQ(weightOf("hall"), Weight(0.5f));
}

TEST_F(LightStateTest, RefusedWeightsChangeNothing) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    for (float bad : {nan, infinity, -infinity, -0.001f, 1.001f}) {
        for (const Weight& w : {Weight(bad), Weight(bad, 0, 0), Weight(0, bad, 0), Weight(0, 0, bad)}) {
            const auto refused = state.setWeight(set("hall"), w);
            ASSERT_FALSE(refused) << bad;
            EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
            EXPECT_THAT(refused.error().message, HasSubstr("\"hall\""));
        }
        const auto refused = state.setDoor(door("front"), bad);
        ASSERT_FALSE(refused) << bad;
        EXPECT_THAT(refused.error().message, HasSubstr("\"front\""));
    }
    expectAsAtTheStart();
    EXPECT_TRUE(state.setWeight(set("alarm"), 2.0f));
    EXPECT_FALSE(state.setWeight(set("alarm"), 2.0001f));
    EXPECT_EQ(weightOf("alarm"), Weight(2));
}

TEST_F(LightStateTest, HandlesOfTheWrongKindAreRefused) {
    EXPECT_FALSE(state.setWeight(LightSet{3}, 0));
    EXPECT_FALSE(state.setWeight(LightSet{99}, 0));
    EXPECT_FALSE(state.setDoor(Door{0}, 0));
    EXPECT_FALSE(state.setDoor(Door{99}, 0));
    expectAsAtTheStart();
}

TEST_F(LightStateTest, HandlesThatNobodyLookedUpAreRefused) {
    EXPECT_EQ(state.setWeight(LightSet(), 0).error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(state.setDoor(Door(), 1).error().code, ErrorCode::InvalidArgument);
    expectAsAtTheStart();
    EXPECT_EQ(state.weight(LightSet()), Weight(0));
    // The first element may as well be a door.
    PackData data;
    data.page_count = data.page_width = data.page_height = 1;
    data.base_pages.resize(1);
    data.elements = {{"front", ElementKind::Door, 1}};
    CpuRuntime doors(*Pack::fromData(std::move(data)));
    EXPECT_EQ(doors.setDoor(Door(), 1).error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(doors.open(Door{0}), 0);
}

TEST_F(LightStateTest, AppliesATextState) {
    ASSERT_TRUE(state.apply(" hall = 0.5 , alarm=1/0.2/0.25, door:front=1"));
    EXPECT_EQ(weightOf("hall"), Weight(0.5f));
    EXPECT_EQ(weightOf("alarm"), Weight(1, 0.2f, 0.25f));
    EXPECT_EQ(weightOf("porch"), Weight(1));
    EXPECT_EQ(state.open(door("front")), 1);
    EXPECT_EQ(state.open(door("porch")), 0);
    ASSERT_TRUE(state.apply(""));
    EXPECT_EQ(weightOf("hall"), Weight(0.5f));
}

TEST_F(LightStateTest, AllComesFirstWhereverItIsWritten) {
    ASSERT_TRUE(state.apply("hall=0.5,all=0,door:porch=0.5"));
    EXPECT_EQ(weightOf("hall"), Weight(0.5f));
    EXPECT_EQ(weightOf("alarm"), Weight(0));
    EXPECT_EQ(weightOf("porch"), Weight(0));
    EXPECT_EQ(state.open(door("porch")), 0.5f);
}

TEST_F(LightStateTest, ABadTextStateNamesTheItemAndChangesNothing) {
    const std::pair<const char*, const char*> cases[] = {
        {"hall=0,halll=1", "\"hall\""},      {"hall=0,alarm=3", "\"alarm\""},
        {"hall=0,alarm=1/2", "1/2"},         {"hall=0,alarm=x", "\"alarm=x\""},
        {"hall=0,alarm", "\"alarm\""},       {"hall=0,=1", "\"=1\""},
        {"hall=0,alarm=", "\"alarm=\""},     {"hall=0,door:front=2", "\"front\""},
        {"hall=0,door:frnt=1", "\"front\""}, {"hall=0,alarm=nan", "\"alarm\""},
        {"hall=0,door:front=1/1/1", "door"}, {"hall=0,,", "State \"hall=0,,\": an item is empty"},
        {"hall=0,all=1.5", "\"hall\""},      {"hall=0,alarm=1e99", "1e99"},
        {"hall=0,alarm=1/1/1/1", "1/1/1/1"}, {"hall=0,alarm=0.5 0.5", "0.5 0.5"},
    };
    for (const auto& [text, named] : cases) {
        const auto refused = state.apply(text);
        ASSERT_FALSE(refused) << text;
        EXPECT_THAT(refused.error().message, HasSubstr(named)) << text;
    }
    expectAsAtTheStart();
}

}  // namespace
}  // namespace dimmer
