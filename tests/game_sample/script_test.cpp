#include <game_sample/script.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/pack_data.h>
#include <probes/tetrahedra.h>

#include <numbers>

namespace dimmer::sample {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Pack makePack() {
    PackData data;
    data.page_width = data.page_height = 8;
    data.page_count = 1;
    data.base_pages.resize(64);
    data.elements = {
        {"hall", ElementKind::LightSet, 1}, {"alarm", ElementKind::LightSet, 2}, {"front", ElementKind::Door, 1}};
    data.viewpoints = {{"player_start", {0, 1, 0}, {0, 0, -1}, 1.0f},
                       {"overview", {1, 2, 3}, {1, 0, 0}, 0.8f},
                       {"upper floor", {4, 5, 6}, {0, 0, 1}, 0.9f}};
    auto pack = Pack::fromData(std::move(data));
    EXPECT_TRUE(pack) << (pack ? "" : pack.error().message);
    return *pack;
}

Script parse(std::string_view text) {
    auto script = parseScript(text, "test.script", makePack());
    EXPECT_TRUE(script) << script.error().message;
    return script ? *script : Script{};
}

std::string parseError(std::string_view text) {
    const auto script = parseScript(text, "test.script", makePack());
    EXPECT_FALSE(script) << text;
    return script ? "" : script.error().message;
}

TEST(SampleScript, ReadsSettings) {
    const Script script = parse("size 320 200\nframes 17\nfps 25\nadapt 0.5\nsky 1 2 3.5\ncamera \"upper floor\"\n");
    EXPECT_EQ(script.width, 320u);
    EXPECT_EQ(script.height, 200u);
    EXPECT_EQ(script.frames, 17u);
    EXPECT_EQ(script.fps, 25);
    EXPECT_EQ(script.adaptation_s, 0.5f);
    EXPECT_EQ(script.sky_cd_m2, glm::vec3(1, 2, 3.5f));
    EXPECT_EQ(script.camera.position_m, glm::vec3(4, 5, 6));
}

TEST(SampleScript, ReadsBallsAndProbes) {
    PackData data = makePack().data();
    const glm::vec3 points[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    data.probes.global = cook::tetrahedralise(points, {glm::vec3(0), glm::vec3(1)}).value();
    data.probes.base.resize(data.probes.global.positions.size());
    data.probes.record_counts.assign(data.contributions.size(), 0);
    const auto pack = Pack::fromData(std::move(data));
    ASSERT_TRUE(pack) << pack.error().message;
    const auto script = parseScript("probes 0.1\nball 0.25 1 2 3 to 4 5 6 over 30\n", "test.script", *pack);
    ASSERT_TRUE(script) << script.error().message;
    EXPECT_EQ(script->probe_radius_m, 0.1f);
    ASSERT_EQ(script->balls.size(), 1u);
    EXPECT_EQ(script->balls[0].radius_m, 0.25f);
    EXPECT_EQ(script->balls[0].from_m, glm::vec3(1, 2, 3));
    EXPECT_EQ(script->balls[0].to_m, glm::vec3(4, 5, 6));
    EXPECT_EQ(script->balls[0].frames, 30u);
    for (const char* wrong : {"ball 1 2 3", "ball 0 0 0 0 to 1 1 1 over 3", "ball 1 0 0 0 to 1 1 1", "probes 0"})
        EXPECT_FALSE(parseScript(wrong, "test.script", *pack)) << wrong;
}

TEST(SampleScript, BeginsWithTheFirstCameraOfTheLevel) {
    EXPECT_EQ(parse("").camera.position_m, glm::vec3(1, 2, 3));
}

TEST(SampleScript, OrdersStepsByFrameAndKeepsTheOrderWithinOne) {
    const Script script = parse("at 9 set hall=0.5  # late\nat 3 set hall=1\n\n# only a comment\nat 3 set hall=0\r\n");
    ASSERT_EQ(script.steps.size(), 3u);
    EXPECT_EQ(script.steps[0].text, "set hall=1");
    EXPECT_EQ(script.steps[1].text, "set hall=0");
    EXPECT_EQ(script.steps[2].frame, 9u);
    EXPECT_EQ(std::get<SetState>(script.steps[2].action).state, "hall=0.5");
}

TEST(SampleScript, ReadsFadesAndFlicker) {
    const Script script = parse(
        "at 1 fade alarm 2 1/0.5/0 over 10\nat 2 flicker hall 0.25 1 for 7 seed 42\n"
        "at 3 fade door:front 0 1 over 4");
    const auto& fade = std::get<Fade>(script.steps[0].action);
    EXPECT_EQ(fade.element, "alarm");
    EXPECT_EQ(fade.from, Weight(2));
    EXPECT_EQ(fade.to, Weight(1, 0.5f, 0));
    EXPECT_EQ(fade.frames, 10u);
    const auto& flicker = std::get<Flicker>(script.steps[1].action);
    EXPECT_EQ(flicker.low, 0.25f);
    EXPECT_EQ(flicker.high, 1.0f);
    EXPECT_EQ(flicker.frames, 7u);
    EXPECT_EQ(flicker.seed, 42u);
    EXPECT_EQ(std::get<Fade>(script.steps[2].action).element, "door:front");
}

TEST(SampleScript, TakesCarriageReturnsForSpaces) {
    const Script script = parse("at 3 fade door:front\r\r 0 1 over 4\r\n");
    EXPECT_EQ(std::get<Fade>(script.steps[0].action).element, "door:front");
}

TEST(SampleScript, ReadsViews) {
    const Script script = parse("camera 0 1 0 look 0 1 -5 fov 90\nat 4 move overview over 20");
    EXPECT_EQ(script.camera.forward, glm::vec3(0, 0, -1));
    EXPECT_NEAR(script.camera.vertical_fov_rad, std::numbers::pi / 2, 1e-6);
    EXPECT_EQ(std::get<CameraMove>(script.steps[0].action).view.position_m, glm::vec3(1, 2, 3));
}

TEST(SampleScript, WithoutFramesLastsASecondPastTheLastStep) {
    EXPECT_EQ(parse("fps 10\nat 5 fade hall 0 1 over 20").frames, 35u);
}

TEST(SampleScript, TellsOfStepsPastTheLastFrame) {
    const Script cut = parse("frames 10\nat 9 set hall=1\nat 10 set hall=0\n");
    ASSERT_EQ(cut.warnings.size(), 1u);
    EXPECT_THAT(cut.warnings[0], AllOf(StartsWith("test.script:3: "), HasSubstr("hall=0"), HasSubstr("10 frames")));
    EXPECT_TRUE(parse("at 10 set hall=0").warnings.empty());
}

TEST(SampleScript, ErrorsNameTheLineAndTheMend) {
    EXPECT_THAT(parseError("\n\nat 5 set hal=1"), AllOf(StartsWith("test.script:3: "), HasSubstr("hal")));
    EXPECT_THAT(parseError("frame 5"), HasSubstr("unknown command \"frame\""));
    EXPECT_THAT(parseError("ball 1 0 0 0 to 1 0 0 over 9"), HasSubstr("balls need a global light grid"));
    EXPECT_THAT(parseError("probes 0.1"), HasSubstr("probes need a global light grid"));
    EXPECT_THAT(parseError("at 5 explode hall"), HasSubstr("unknown action \"explode\""));
    EXPECT_THAT(parseError("camera attic"), HasSubstr("overview"));
    EXPECT_THAT(parseError("at x set hall=1"), HasSubstr("\"x\""));
    EXPECT_THAT(parseError("frames 0"), HasSubstr("1.."));
    EXPECT_THAT(parseError("size 10"), HasSubstr("whole number"));
    EXPECT_THAT(parseError("frames 5 6"), HasSubstr("\"6\" is left over"));
    EXPECT_THAT(parseError("camera 0 0 0 1 1 1"), HasSubstr("look"));
    EXPECT_THAT(parseError("camera 1 1 1 look 1 1 1"), HasSubstr("where it stands"));
    EXPECT_THAT(parseError("at 1 fade hall 0 1"), HasSubstr("over"));
    EXPECT_THAT(parseError("at 1 flicker front 0 1 for 5"), HasSubstr("front"));
    EXPECT_THAT(parseError("at 1 flicker hall 0.5 0.25 for 5"), HasSubstr("0.25"));
}

TEST(SampleScript, RefusesWeightsThatTheRuntimeWouldRefuse) {
    EXPECT_THAT(parseError("at 0 set hall=1.5"), HasSubstr("hall"));
    EXPECT_THAT(parseError("at 0 fade hall 0 1.5 over 3"), HasSubstr("hall"));
    EXPECT_THAT(parseError("at 0 set door:front=2"), HasSubstr("front"));
    EXPECT_THAT(parseError("at 0 fade all 0 1 over 3"), HasSubstr("one light set or one door"));
    EXPECT_EQ(parse("at 0 set alarm=2").steps.size(), 1u);
}

// A '#' within a name or a text is no comment.
TEST(SampleScript, CommentsBeginWords) {
    EXPECT_EQ(parse("frames 4 # four").frames, 4u);
    EXPECT_EQ(parse("# nothing\nframes 5\t#five").frames, 5u);
    EXPECT_EQ(parse("camera \"upper floor\" # two words\nframes 6").frames, 6u);
    EXPECT_THAT(parseError("at 0 set 6\"hall=1 # dim"), testing::Not(HasSubstr("dim")));
    EXPECT_THAT(parseError("at 0 set hall#1=0.5"), HasSubstr("hall#1"));
    EXPECT_THAT(parseError("camera \"cam #2\""), HasSubstr("cam #2"));
}

// A name that begins with '#' was taken for a comment, and the step for one that says nothing.
TEST(SampleScript, StatesMayBeInQuotes) {
    const auto stateOf = [](const Script& script) { return std::get<SetState>(script.steps.at(0).action).state; };
    EXPECT_EQ(stateOf(parse("at 0 set \"hall=0.5, alarm=2\" # dim")), "hall=0.5, alarm=2");
    EXPECT_THAT(parseError("at 0 set \"#hall=1\""), HasSubstr("#hall"));
    for (const char* nothing : {"at 0 set", "at 0 set \"\"", "at 0 set #hall=0"})
        EXPECT_THAT(parseError(nothing), HasSubstr("in quotes")) << nothing;
}

TEST(SampleScript, ByteOrderMarksAreNone) {
    EXPECT_EQ(parse("\xef\xbb\xbf# begins\nframes 7").frames, 7u);
}

}  // namespace
}  // namespace dimmer::sample
