// What a profile may say, where each setting comes from, and what a mistake in one is answered with.
#include <gmock/gmock.h>
#include <pipeline/profile.h>
#include <pipeline/small_level.h>
#include <sys/stat.h>

namespace dimmer::cook::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Expected<Profile> load(const std::string& text) {
    const TemporaryFolder folder;
    return loadProfile(writeText(folder, "mine.json", text).string());
}

void expectBad(const std::string& text, const std::vector<std::string>& fragments) {
    const auto profile = load(text);
    ASSERT_FALSE(profile.has_value()) << text;
    EXPECT_EQ(profile.error().code, ErrorCode::BadInput) << text;
    EXPECT_THAT(profile.error().message, HasSubstr("mine.json")) << text;
    for (const std::string& f : fragments) EXPECT_THAT(profile.error().message, HasSubstr(f)) << text;
}

TEST(Profile, EveryShippedOneLoads) {
    EXPECT_THAT(shippedProfiles(), testing::UnorderedElementsAre("console", "desktop", "handheld", "lavapipe"));
    for (const std::string& name : shippedProfiles()) {
        const auto profile = loadProfile(name);
        ASSERT_TRUE(profile.has_value()) << name << ": " << profile.error().message;
        EXPECT_GT(profile->budget_total, 0u) << name;
        EXPECT_LT(profile->draft.rays, profile->preview.rays) << name;
        EXPECT_LT(profile->preview.rays, profile->final.rays) << name;
    }
    // UBERBAKE's Table 1: 50 MB of dynamic records (binary megabytes), 77 MB in all.
    EXPECT_EQ(loadProfile("console")->budget_dynamic, 50u << 20);
    EXPECT_EQ(loadProfile("console")->budget_total, 77u << 20);
}

// A pipe may never end, and is gone once read.
TEST(Profile, IsNoPipeAndNoFolder) {
    const TemporaryFolder folder;
    const std::string pipe = (folder.path / "pipe").string();
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const std::string extending = writeText(folder, "mine.json", R"({"extends": "pipe"})").string();
    for (const std::string& name : {pipe, folder.path.string(), std::string("/dev/null"), extending}) {
        const auto profile = loadProfile(name);
        ASSERT_FALSE(profile.has_value()) << name;
        EXPECT_THAT(profile.error().message,
                    AllOf(HasSubstr("profile " + (name == extending ? pipe : name) + ": "),
                          HasSubstr("a profile must be a regular file"), testing::Not(HasSubstr("there is no"))));
    }
}

TEST(Profile, ExtendsWhatItNamesAndDesktopOtherwise) {
    const auto handheld = load(R"({"extends": "handheld", "records": {"threshold": 0.5}})");
    ASSERT_TRUE(handheld.has_value()) << handheld.error().message;
    EXPECT_EQ(handheld->texels_per_metre, 2);
    EXPECT_EQ(handheld->page_size, 1024u);
    EXPECT_EQ(handheld->threshold, 0.5f);
    EXPECT_EQ(handheld->final.rays, loadProfile("desktop")->final.rays);

    const auto plain = load(R"({"bake": {"final": {"rays": 7}}})");
    ASSERT_TRUE(plain.has_value()) << plain.error().message;
    EXPECT_EQ(plain->final.rays, 7u);
    EXPECT_EQ(plain->budget_total, loadProfile("desktop")->budget_total);
    EXPECT_EQ(plain->texels_per_metre, 4);
    EXPECT_TRUE(load("{}").has_value());
    EXPECT_TRUE(load(R"({"description": "anything"})").has_value());
}

TEST(Profile, ExtendsAFileBesideIt) {
    const TemporaryFolder folder;
    writeText(folder, "base.json", R"({"lightmaps": {"texels_per_metre": 3}})");
    const auto top = writeText(folder, "top.json", R"({"extends": "base.json", "lightmaps": {"page_size": 512}})");
    const auto profile = loadProfile(top.string());  // the working folder is another one
    ASSERT_TRUE(profile.has_value()) << profile.error().message;
    EXPECT_EQ(profile->texels_per_metre, 3);
    EXPECT_EQ(profile->page_size, 512u);
    EXPECT_EQ(profile->origin.at("lightmaps.texels_per_metre"), "base.json");
    EXPECT_EQ(profile->origin.at("lightmaps.page_size"), "top.json");
    EXPECT_EQ(profile->origin.at("records.threshold"), "desktop");
}

TEST(Profile, TellsTheFilesThatItExtends) {
    const TemporaryFolder folder;
    const auto base = writeText(folder, "base.json", R"({"extends": "handheld"})");
    const auto middle = writeText(folder, "middle.json", R"({"extends": "base.json"})");
    const auto top = writeText(folder, "top.json", R"({"extends": "middle.json"})");
    EXPECT_THAT(filesExtendedBy(top.string()), testing::ElementsAre(middle, base));
    for (const std::string& none :
         {base.string(), std::string("console"), std::string("no such"), writeText(folder, "broken.json", "{").string(),
          writeText(folder, "lost.json", R"({"extends": "gone.json"})").string()})
        EXPECT_THAT(filesExtendedBy(none), testing::IsEmpty()) << none;
    const auto circle = writeText(folder, "circle.json", R"({"extends": "circle.json"})");
    EXPECT_THAT(filesExtendedBy(circle.string()), testing::Each(circle));
}

TEST(Profile, UnknownKeysAreNamedWithTheNearest) {
    expectBad(R"({"lightmaps": {"page_sice": 512}})", {"'lightmaps.page_sice'", "did you mean 'lightmaps.page_size'?"});
    expectBad(R"({"lightmap": {"page_size": 512}})", {"did you mean 'lightmaps.page_size'?"});
    expectBad(R"({"extend": "desktop"})", {"'extend'", "did you mean 'extends'?"});
    expectBad(R"({"records": {"max_overlap": 8}})", {"did you mean 'records.overlap_max'?"});
    expectBad(R"({"grids": {"max_probes": 8}})", {"did you mean 'grids.probes_max'?"});
    expectBad("{\"records\": {\"threshold\": 0.1,\n\"threshold\": 0.2}}", {":2: 'records.threshold' is there twice"});
    expectBad("{\"records.threshold\": 0.1,\n\"records\": {\n\"threshold\": 0.2}}",
              {":3: 'records.threshold' is there twice"});
    expectBad(R"({"texels_per_metre": 4})", {"did you mean 'lightmaps.texels_per_metre'?"});
    expectBad(R"({"bounces": 4})",
              {"did you mean 'bake.draft.bounces' or 'bake.preview.bounces' or 'bake.final.bounces'?"});
    expectBad(R"({"quality": "final"})", {"an option: --quality"});
    expectBad("{\n\"bugdets\": {}}", {":2: 'bugdets' is no setting"});
    expectBad(R"({"kernels": {}})", {"'kernels' is no setting"});
    expectBad("{\n\"extends\": \"no such\"}", {":2: ", "'extends'", "no such"});
    expectBad(R"({"description": 5})", {"'description' must be a text"});
    expectBad(R"({"description": {}})", {"'description' must be a text"});
    expectBad(R"({"$schema": null})", {"'$schema' must be a text"});
    expectBad(R"({"zzzzzzzz": 1})", {"'zzzzzzzz' is no setting; there are: ", "budgets.total", "bake.final.tolerance"});
    expectBad(R"({"bake": {"draft": {"rays": {"deep": {"er": 1}}}}})", {"nests deeper"});
}

TEST(Profile, WrongTypes) {
    expectBad(R"({"records": {"threshold": "0.01"}})", {"'records.threshold' must be a number"});
    expectBad(R"({"records": {"threshold": null}})", {"'records.threshold' must be a number"});
    expectBad(R"({"records": {"threshold": [1]}})", {"'records.threshold' must be a number"});
    expectBad(R"({"lightmaps": {"page_size": 512.5}})", {"'lightmaps.page_size' is 512.5", "whole number"});
    expectBad(R"({"lightmaps": 4})", {"'lightmaps' must be an object, not number"});
    expectBad(R"({"lightmaps": {"page_size": {}}})", {"'lightmaps.page_size' must be a number"});
    expectBad(R"({"records": {"thresholds": 3}})", {"'records.thresholds' must be an object, not number"});
    expectBad(R"({"extends": 3})", {"'extends' must be"});
}

TEST(Profile, OutOfRange) {
    for (const auto& [text, key] :
         {std::pair{R"({"lightmaps": {"page_size": 32}})", "page_size' is 32, outside 64 .. 4096"},
          {R"({"lightmaps": {"page_size": 4097}})", "page_size' is 4097"},
          {R"({"lightmaps": {"texels_per_metre": 0}})", "texels_per_metre' is 0, outside"},
          {R"({"records": {"threshold": 1.5}})", "threshold' is 1.5, outside 0 .. 1"},
          {R"({"budgets": {"total": -1}})", "budgets.total' is -1"},
          {R"({"bake": {"draft": {"rays": 0}}})", "bake.draft.rays' is 0, outside 1"}})
        expectBad(text, {key});
}

TEST(Profile, NotJson) {
    expectBad("", {"not JSON"});
    expectBad("{\n\"records\": {,}}", {"not JSON", "line 2"});
    expectBad(R"({"records": {"threshold": 1e999}})", {"not JSON"});
    expectBad("[1, 2]", {"a JSON object was expected, not array"});
    std::string deep;
    for (int i = 0; i < 100000; ++i) deep += "{\"a\":";
    expectBad(deep + "1" + std::string(100000, '}'), {"nests deeper"});
    expectBad("{\"a\":" + std::string(100000, '[') + std::string(100000, ']') + "}", {"nests deeper"});
}

TEST(Profile, Circles) {
    const TemporaryFolder folder;
    writeText(folder, "a.json", R"({"extends": "b.json"})");
    const auto b = writeText(folder, "b.json", R"({"extends": "a.json"})");
    const auto self = writeText(folder, "self.json", R"({"extends": "self.json"})");
    for (const auto& path : {b, self}) {
        const auto profile = loadProfile(path.string());
        ASSERT_FALSE(profile.has_value());
        EXPECT_EQ(profile.error().code, ErrorCode::BadInput);
        EXPECT_THAT(profile.error().message, HasSubstr("in a circle"));
    }
}

TEST(Profile, Missing) {
    for (const char* name : {"no_such.json", "/"}) {
        const auto profile = loadProfile(name);
        ASSERT_FALSE(profile.has_value());
        EXPECT_EQ(profile.error().code, ErrorCode::NotFound);
        EXPECT_THAT(profile.error().message, AllOf(HasSubstr(name), HasSubstr("console, desktop, handheld, lavapipe")));
    }
    EXPECT_THAT(loadProfile("dekstop").error().message, HasSubstr("did you mean 'desktop'?"));
    expectBad(R"({"extends": "nothing.json"})", {"'extends'", "nothing.json"});
}

// What the pack keeps: each setting's value, as a person wrote it, and where it comes from.
TEST(Profile, SettingsSayWhereTheyComeFrom) {
    const auto profile = load(R"({"extends": "handheld", "records": {"threshold": 0.1}})");
    ASSERT_TRUE(profile.has_value());
    const json settings = json::parse(profile->settingsJson("preview"));
    EXPECT_EQ(settings["quality"], json({{"value", "preview"}, {"from", "default"}}));
    EXPECT_EQ(settings["records.threshold"], json({{"value", 0.1}, {"from", "mine.json"}}));
    EXPECT_EQ(settings["lightmaps.page_size"], json({{"value", 1024}, {"from", "handheld"}}));
    EXPECT_EQ(settings["bake.preview.rays"]["from"], "desktop");
    EXPECT_EQ(settings["budgets.per_element"], json({{"value", 0}, {"from", "default"}}));
    EXPECT_FALSE(settings.contains("bake.final.rays"));  // did not take part
    EXPECT_EQ(profile->settingsJson("preview"), profile->settingsJson("preview"));
}

TEST(Profile, AFileNameThatIsNoUtf8IsNoReasonToFail) {
    const TemporaryFolder folder;
    const auto profile = loadProfile(writeText(folder, "m\xff.json", R"({"records": {"threshold": 0.1}})").string());
    ASSERT_TRUE(profile.has_value()) << profile.error().message;
    const json settings = json::parse(profile->settingsJson("preview"));
    EXPECT_EQ(settings["records.threshold"]["from"], "m\xef\xbf\xbd.json");  // U+FFFD in the place of what is no UTF-8
}

TEST(Profile, Qualities) {
    const auto profile = loadProfile("desktop");
    ASSERT_TRUE(profile.has_value());
    EXPECT_EQ(profile->quality("draft"), &profile->draft);
    EXPECT_EQ(profile->quality("preview"), &profile->preview);
    EXPECT_EQ(profile->quality("final"), &profile->final);
    EXPECT_EQ(profile->quality("Final"), nullptr);
}

}  // namespace
}  // namespace dimmer::cook::test
