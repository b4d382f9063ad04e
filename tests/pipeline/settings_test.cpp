// The list of settings: the schema that goes by it, where a mistake stands, and who has the last word.
#include <app/process.h>
#include <gmock/gmock.h>
#include <pipeline/json_lines.h>
#include <pipeline/settings.h>
#include <pipeline/small_level.h>

#include <cstdlib>
#include <fstream>
#include <map>

namespace dimmer::cook::test {
namespace {

using dimmer::test::readText;
using testing::AllOf;
using testing::HasSubstr;

const std::filesystem::path schema_file = std::filesystem::path(DIMMER_SOURCE_DIR) / "profiles/schema.json";

// With DIMMER_WRITE_SCHEMA set, the file is written anew: look at the difference before it is committed.
TEST(Settings, TheSchemaIsThatOfTheList) {
    if (std::getenv("DIMMER_WRITE_SCHEMA")) std::ofstream(schema_file) << settingsSchema();
    EXPECT_EQ(readText(schema_file), settingsSchema());
}

// Every key of the list is in the schema with its description, and every key of the schema is in the list.
TEST(Settings, TheSchemaHoldsEverySettingOnce) {
    Profile profile;
    const json schema = json::parse(readText(schema_file));
    size_t leaves = 0;
    const auto count = [&](const json& object, const auto& self) -> void {
        EXPECT_EQ(object["additionalProperties"].is_boolean(), object.contains("properties"));
        const json properties = object.value("properties", json::object());
        for (const auto& [key, value] : properties.items()) {
            if (value.contains("properties"))
                self(value, self);
            else
                ++leaves;
        }
    };
    count(schema, count);
    const auto settings = settingsOf(profile);
    EXPECT_EQ(leaves, settings.size() + 4);  // $schema, description, extends, records.thresholds
    for (const Setting& s : settings) {
        json::json_pointer place;
        std::istringstream parts(s.key);
        for (std::string part; std::getline(parts, part, '.');) place = place / "properties" / part;
        ASSERT_TRUE(schema.contains(place)) << s.key;
        EXPECT_GT(schema[place]["description"].get<std::string>().size(), 30u) << s.key;
        if (schema[place].contains("minimum")) {
            EXPECT_EQ(schema[place]["minimum"], s.least) << s.key;
            EXPECT_EQ(schema[place]["maximum"], s.most) << s.key;
        }
    }
}

// What a profile gets that says nothing: desktop.json's, and of what that does not state the values here.
TEST(Settings, TheSchemaHoldsEveryDefault) {
    const json schema = json::parse(readText(schema_file));
    const json desktop = json::parse(readText(schema_file.parent_path() / "desktop.json")).flatten();
    std::map<std::string, json> defaults = {
        {"/budgets/base_lightmaps", 0}, {"/budgets/global_grid", 0},     {"/budgets/local_grids", 0},
        {"/budgets/per_element", 0},    {"/records/door_share", 0.2},    {"/records/overlap_max", 0},
        {"/grids/global", "auto"},      {"/grids/local_probes_max", 64}, {"/grids/probes_per_m3", 0},
    };
    for (const auto& [place, value] : desktop.items())
        if (place != "/$schema" && place != "/description") defaults[place] = value;
    for (const auto& [place, value] : defaults) {
        std::string in_schema = place;
        for (size_t at = 0; (at = in_schema.find('/', at)) != std::string::npos; at += sizeof("/properties/") - 1)
            in_schema.replace(at, 1, "/properties/");
        EXPECT_EQ(schema.value(json::json_pointer(in_schema + "/default"), json()), value) << place;
    }
    Profile profile;
    EXPECT_EQ(defaults.size(), settingsOf(profile).size());
}

TEST(Settings, ShippedProfilesNameTheSchemaAndKeepToIt) {
    for (const std::string& name : shippedProfiles()) {
        const json profile = json::parse(readText(schema_file.parent_path() / (name + ".json")));
        EXPECT_EQ(profile["$schema"], "schema.json") << name;
    }
}

TEST(JsonLines, NestedKeysStringsAndArrays) {
    const auto lines =
        linesOfKeys("{\n\"a\": {\"b\":\n [1, {\"x\": 2}],\n\n\"c\\u0064\": \"{:\\\"\"},\n \"a2\": \"a\\\\\"\n}");
    EXPECT_EQ(lines.at("a"), 2u);
    EXPECT_EQ(lines.at("a.b"), 2u);
    EXPECT_EQ(lines.at("a.cd"), 5u);
    EXPECT_EQ(lines.at("a2"), 6u);
    EXPECT_EQ(linesOfKeys("{\"a\": 1,\n\"a\": 2}").at("a"), 2u);
    // What is no JSON any more makes no keys, and so no memory that grows with its square.
    EXPECT_EQ(linesOfKeys("{\"a\": {\"b\": 1}} {\"c\": {\"d\"" + std::string(1000, ':')).size(), 4u);
}

TEST(Settings, AMistakeSaysItsLine) {
    const TemporaryFolder folder;
    const auto load = [&](const std::string& text) {
        const auto profile = loadProfile(writeText(folder, "mine.json", text).string());
        return profile ? std::string("no error") : profile.error().message;
    };
    EXPECT_THAT(load("{\n  \"records\": {\n    \"treshold\": 0.1\n  }\n}"),
                AllOf(HasSubstr("mine.json:3: "), HasSubstr("did you mean 'records.threshold'?")));
    EXPECT_THAT(load("{\n\n  \"lightmaps\": {\"page_size\": \"big\"}}"),
                AllOf(HasSubstr("mine.json:3: "), HasSubstr("'lightmaps.page_size' must be a number")));
    EXPECT_THAT(load("{\"records\": {\"thresholds\":\n {\"hall\":\n 2}}}"),
                AllOf(HasSubstr("mine.json:2: "), HasSubstr("'records.thresholds.hall' is 2, outside 0 .. 1")));
}

// default < profile < level < command line, and the pack says which it was.
TEST(Settings, WhoHasTheLastWord) {
    const TemporaryFolder folder;
    LevelFile level = twoCells();
    level.document["scenes"][0]["extras"]["dimmer_settings"] =
        "lightmaps.texels_per_metre=3, records.threshold=0.2,lightmaps.model=linear";
    const auto profile = writeText(folder, "mine.json", R"({"lightmaps": {"texels_per_metre": 5, "page_size": 512},
        "records": {"threshold": 0.1},
        "bake": {"draft": {"samples_per_texel": 1, "series_rays": 4, "rays": 4, "emitter_samples": 1}}})");
    SilentProgress silent;
    const auto result = cook({.level = writeLevel(folder, level),
                              .pack = folder.path / "level.dimmer",
                              .profile = profile.string(),
                              .quality = "draft",
                              .set = {"records.threshold=0.3", "records.thresholds.one=0.5"}},
                             silent);
    ASSERT_TRUE(result.has_value()) << result.error().message;
    const json settings = json::parse(result->pack.settings_json);
    const auto expect = [&](const char* key, const json& value, const char* from) {
        EXPECT_EQ(settings[key], json({{"value", value}, {"from", from}})) << key;
    };
    expect("records.threshold", 0.3, "command line");
    expect("records.thresholds.one", 0.5, "command line");
    expect("lightmaps.texels_per_metre", 3.0, "level");
    expect("lightmaps.model", "linear", "level");
    expect("lightmaps.page_size", 512, "mine.json");
    expect("lightmaps.color", "e5b9g9r9", "desktop");
    expect("budgets.per_element", 0, "default");
    EXPECT_EQ(result->pack.direction_model, DirectionModel::Linear);
    const auto again = readSettings(result->pack.settings_json);
    ASSERT_TRUE(again.has_value()) << again.error().message;
    EXPECT_EQ(again->profile.set_thresholds.at("one"), 0.5f);
}

TEST(Settings, MistakesOfLevelAndCommandLine) {
    const TemporaryFolder folder;
    const auto message = [&](const json& in_level, const std::vector<std::string>& set) {
        LevelFile level = twoCells();
        if (!in_level.is_null()) level.document["scenes"][0]["extras"]["dimmer_settings"] = in_level;
        SilentProgress silent;
        const auto result = cook(
            {.level = writeLevel(folder, level), .pack = folder.path / "level.dimmer", .quality = "draft", .set = set},
            silent);
        if (result) return std::string("no error");
        EXPECT_EQ(result.error().code, ErrorCode::BadInput);
        return result.error().message;
    };
    EXPECT_THAT(message(nullptr, {"records.treshold=1"}),
                AllOf(HasSubstr("--set: "), HasSubstr("did you mean 'records.threshold'?")));
    EXPECT_THAT(message(nullptr, {"records.threshold"}), HasSubstr("not of the form key=value"));
    EXPECT_THAT(message(nullptr, {"lightmaps.page_size=many"}), HasSubstr("must be a number"));
    EXPECT_THAT(message(nullptr, {"records.thresholds.won=0.1"}),
                AllOf(HasSubstr("names no light set"), HasSubstr("did you mean 'one'?")));
    EXPECT_THAT(message("lightmaps.colour=ahd", {}),
                AllOf(HasSubstr("level.gltf"), HasSubstr("'dimmer_settings'"), HasSubstr("'lightmaps.color'")));
    EXPECT_THAT(message(3, {}), AllOf(HasSubstr("level.gltf"), HasSubstr("'dimmer_settings'")));
    EXPECT_FALSE(std::filesystem::exists(folder.path / "level.dimmer"));
}

// A profile has settings for every quality; the command line names one for a reason. From the cache it says so too.
TEST(Settings, TheCommandLineIsToldWhatDoesNothingAtThisQuality) {
    const TemporaryFolder folder;
    const auto level = writeLevel(folder, twoCells());
    const auto profile = writeText(folder, "mine.json", R"({"bake": {"final": {"bounces": 9},
        "draft": {"samples_per_texel": 1, "series_rays": 4, "emitter_samples": 1}}})");
    for (int round = 0; round < 2; ++round) {
        SilentProgress silent;
        const auto result = cook({.level = level,
                                  .pack = folder.path / "level.dimmer",
                                  .profile = profile.string(),
                                  .quality = "draft",
                                  .set = {"bake.final.rays=7", "bake.draft.rays=4"},
                                  .cache = folder.path / "cache"},
                                 silent);
        ASSERT_TRUE(result.has_value()) << result.error().message;
        EXPECT_THAT(result->stats.warnings,
                    testing::Contains(AllOf(HasSubstr("--set bake.final.rays"), HasSubstr("'draft'"))));
        for (const char* unsaid : {"bake.draft", "bounces"})
            EXPECT_THAT(result->stats.warnings, testing::Not(testing::Contains(HasSubstr(unsaid)))) << round;
    }
}

// One profile serves many levels: what it says of a set that this one has not is a warning that names the profile.
TEST(Settings, AProfileMayNameSetsOfOtherLevels) {
    const TemporaryFolder folder;
    const auto level = writeLevel(folder, twoCells());
    const auto cookWith = [&](const std::string& thresholds) {
        const auto profile = writeText(folder, "mine.json", R"({"records": {"thresholds": {)" + thresholds + R"(}},
            "bake": {"draft": {"samples_per_texel": 1, "series_rays": 4, "rays": 4, "emitter_samples": 1}}})");
        SilentProgress silent;
        auto result = cook({.level = level,
                            .pack = folder.path / "level.dimmer",
                            .profile = profile.string(),
                            .quality = "draft",
                            .cache = folder.path / "cache"},
                           silent);
        EXPECT_TRUE(result.has_value()) << result.error().message;
        return result ? std::move(*result) : CookResult{};
    };
    const auto named = testing::Contains(
        AllOf(HasSubstr("mine.json"), HasSubstr("'records.thresholds.won'"), HasSubstr("did you mean 'one'?")));
    const CookResult plain = cookWith(R"("one": 0.5)");
    EXPECT_THAT(plain.stats.warnings, testing::Not(named));
    // The same pack; what the cache says of it is of this cook.
    const CookResult result = cookWith(R"("won": 0.4, "one": 0.5)");
    EXPECT_THAT(result.stats.warnings, named);
    EXPECT_THAT(cookWith(R"("one": 0.5)").stats.warnings, testing::Not(named));
    const json settings = json::parse(result.pack.settings_json);
    EXPECT_FALSE(settings.contains("records.thresholds.won"));
    EXPECT_EQ(settings["records.thresholds.one"]["from"], "mine.json");
}

// A set's own threshold changes that set alone.
TEST(Settings, AThresholdForOneSet) {
    Profile profile = smallProfile();
    const auto before = cookLevel(twoCells(), profile);
    // Of the mean itself: there are always receivers below. Of nine tenths, in a white cell, only by rays' noise.
    profile.set_thresholds["one"] = 1;
    const auto after = cookLevel(twoCells(), profile);
    ASSERT_TRUE(before && after);
    EXPECT_LT(after->contributions[0].receivers, before->contributions[0].receivers);
    EXPECT_EQ(after->contributions[1].receivers, before->contributions[1].receivers);
    EXPECT_EQ(after->contributions[2].receivers, before->contributions[2].receivers);
    EXPECT_GT(after->contributions[0].energy_dropped, before->contributions[0].energy_dropped);
}

}  // namespace
}  // namespace dimmer::cook::test
