// Causes of error: each made large or taken away by the setting that governs it.
#include <pipeline/dissect.h>
#include <pipeline/small_level.h>
#include <pipeline/verify.h>

namespace dimmer::cook::test {
namespace {

// Two rooms with lamps whose direct light a renderer would draw: all that is stored is gathered.
Scene cells() {
    LevelFile level = twoCells();
    for (json& node : level.document["nodes"])
        if (node.contains("extras")) node["extras"].erase("dimmer_bake");
    return *level.import();
}

Profile fineProfile() {
    Profile profile = smallProfile();
    profile.texels_per_metre = 6;
    profile.threshold = 0;
    profile.draft = {.samples_per_texel = 8, .series_rays = 64, .rays = 512, .emitter_samples = 2, .tolerance = 0.001f};
    return profile;
}

Expected<VerifyReport> dissected(const Profile& profile, bool formats = false, const Scene& scene = cells(),
                                 const std::string& state = "") {
    SilentProgress progress;
    CookStats stats;
    auto data = cookScene(scene, profile, "draft", progress, stats);
    if (!data) return std::unexpected(data.error());
    const auto pack = Pack::fromData(std::move(*data));
    if (!pack) return std::unexpected(pack.error());
    return verify(scene, *pack,
                  {.state = state, .points = 50, .paths_max = 2048, .sets = false, .causes = true, .formats = formats},
                  progress);
}

TEST(Dissect, EachCauseFollowsItsSetting) {
    const auto fine = dissected(fineProfile());
    ASSERT_TRUE(fine) << fine.error().message;
    Profile coarse = fineProfile(), noisy = fineProfile(), sparse = fineProfile();
    coarse.texels_per_metre = 1;
    noisy.draft.rays = 16;
    sparse.threshold = 1;
    const auto with_coarse = dissected(coarse), with_noise = dissected(noisy), with_threshold = dissected(sparse);
    ASSERT_TRUE(with_coarse && with_noise && with_threshold);
    const auto cause = [](const auto& report, const char* name) { return report->causes.at(name); };
    EXPECT_EQ(cause(fine, "activity_threshold"), 0);
    EXPECT_GT(cause(with_threshold, "activity_threshold"), 0.001);
    // 16 rays against 512: the root of 32 is 5.7, and rays of a sequence do better than that.
    EXPECT_GT(cause(with_noise, "noise"), 4 * cause(fine, "noise"));
    EXPECT_LT(cause(fine, "noise"), 0.02);
    // What interpolation misses goes with the square of the texel's side where light is smooth, with the side at edges.
    // Six times the side; the noise of two gathers hides most of what is left at the fine one.
    EXPECT_GT(cause(with_coarse, "texel_size"), 2 * cause(fine, "texel_size"));
    EXPECT_LT(cause(fine, "series_expansion"), 0.02);
    // The steps lead from the truth to the pack: the whole error is at most their sum.
    for (const auto* report : {&fine, &with_coarse, &with_noise, &with_threshold}) {
        double sum = 0;
        for (const char* name : {"series_expansion", "texel_size", "activity_threshold", "noise", "colour_format"})
            sum += cause(*report, name);
        // 2 % for the noise of 2,048 paths, which every step leaves out.
        EXPECT_LE((*report)->surface.mean, sum + 0.02);
    }
}

TEST(Dissect, FinerFormatsAreMeasuredAsFiner) {
    const auto report = dissected(fineProfile(), true);
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_EQ(report->formats.size(), 12u);
    const auto mean = [&](ColorFormat format, DirectionModel model, uint32_t sets) {
        for (const FormatError& f : report->formats)
            if (f.color_format == format && f.direction_model == model && f.sets == sets) return f.mean;
        ADD_FAILURE();
        return 0.0;
    };
    for (const uint32_t sets : {1u, 3u, 8u}) {
        EXPECT_LT(mean(ColorFormat::E5B9G9R9, DirectionModel::Ahd, sets),
                  mean(ColorFormat::R11G11B10F, DirectionModel::Ahd, sets));
        // Light of a closed room has no edge within 60 degrees: the model is within a few per cent.
        EXPECT_LT(mean(ColorFormat::E5B9G9R9, DirectionModel::Ahd, sets), 0.03);
    }
}

// A panel on each side of a floor, one always on, one in a set. Bakes know both at the unit of their own brightness: a
// set a hundred thousandth as bright leaves the errors of the other panel's light, one as bright gives those of the
// mixture.
TEST(Dissect, FormatsAreMeasuredOnSetsAsBrightAsTheyAre) {
    const auto errorBeside = [](double set_cd_m2) {
        LevelFile level;
        const json black = {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 0}}},
                            {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0}}}}}};
        level.addNode({{"name", "floor"}, {"mesh", level.addSquareMesh(level.addMaterial(black))}});
        level.document["extensionsUsed"].push_back("KHR_materials_emissive_strength");
        const auto addPanel = [&](double x, double cd_m2) -> json& {
            json glow = black;
            glow["emissiveFactor"] = {1, 1, 1};
            glow["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = cd_m2;
            return level.node(level.addNode({{"name", "panel"},
                                             {"mesh", level.addSquareMesh(level.addMaterial(glow))},
                                             {"translation", {x, 0, 1}},
                                             {"rotation", {0, 1, 0, 0}},
                                             {"scale", {0.2, 0.2, 0.2}}}));
        };
        addPanel(-1, 400);
        addPanel(1, set_cd_m2)["extras"]["dimmer_light_set"] = "right";
        const auto scene = level.import();
        EXPECT_TRUE(scene) << scene.error().message;
        SilentProgress silent;
        CookStats stats;
        auto data = cookScene(*scene, fineProfile(), "draft", silent, stats);
        EXPECT_TRUE(data) << data.error().message;
        const VerifyOptions options{.state = "", .points = 60, .paths_max = 64, .sets = false, .formats = true};
        const auto report = verify(*scene, *Pack::fromData(std::move(*data)), options, silent);
        EXPECT_TRUE(report) << report.error().message;
        for (const FormatError& f : report->formats)
            if (f.color_format == ColorFormat::E5B9G9R9 && f.direction_model == DirectionModel::Linear && f.sets == 1)
                return f.mean;
        ADD_FAILURE();
        return 0.0;
    };
    // A hundred thousandth of the light is below the thousandth by which errors know light (their floor, a hundredth of
    // the mean, at a tenth).
    const double beside_faint = errorBeside(0.004), beside_fainter = errorBeside(0.0004);
    const double beside_bright = errorBeside(400);
    EXPECT_NEAR(beside_faint, beside_fainter, 0.03 * beside_faint);
    EXPECT_GT(std::abs(beside_bright - beside_faint), 0.1 * beside_faint);
}

// A set of three lamps in one room, baked whole and lamp by lamp: the same light, so the same causes, and what formats
// make of the set is not what they make of one lamp.
TEST(Dissect, LampsTakenApartAreToldOfAsTheirSet) {
    LevelFile level = twoCells();
    for (json& node : level.document["nodes"])
        if (node.contains("extras")) node["extras"] = {{"dimmer_light_set", "both"}};
    for (json& node : level.document["nodes"])
        if (node["name"] == "lamp3" || node["name"] == "lamp4")
            node["translation"][0] = node["translation"][0].get<double>() - 8;
    const Scene scene = *level.import();
    Profile apart = fineProfile();
    apart.draft.lamps_apart = 8;
    const auto whole = dissected(fineProfile(), true, scene, "both=1");
    const auto parts = dissected(apart, true, scene, "both=1");
    ASSERT_TRUE(whole) << whole.error().message;
    ASSERT_TRUE(parts) << parts.error().message;
    ASSERT_EQ(whole->formats.size(), parts->formats.size());
    // The gathers at points take the same rays; light within a bake is rounded to 7 bits, at random, a thousand times
    // a point (2e-4 of its light), beside errors of some per cent.
    for (size_t i = 0; i < whole->formats.size(); ++i)
        EXPECT_NEAR(parts->formats[i].mean, whole->formats[i].mean, 5e-4) << i;
    for (const auto& [name, error] : whole->causes) EXPECT_NEAR(parts->causes.at(name), error, 0.003) << name;
    EXPECT_NEAR(parts->surface.mean, whole->surface.mean, 0.003);
}

struct CountedStages final : SilentProgress {
    int count = 0;
    void stage(std::string_view, uint64_t) override { ++count; }
};

// Before anything is measured.
TEST(Dissect, WhatCannotBeToldApartIsRefusedAtOnce) {
    LevelFile level = twoCells();
    level.addNode(
        {{"name", "leaf"}, {"mesh", addRoomMesh(level, {3, 0, 0}, 1, 0)}, {"extras", {{"dimmer_door", "front"}}}});
    const auto scene = level.import();
    ASSERT_TRUE(scene) << scene.error().message;
    SilentProgress silent;
    CookStats stats;
    const auto data = cookScene(*scene, smallProfile(), "draft", silent, stats);
    ASSERT_TRUE(data) << data.error().message;
    const auto expectRefused = [&](const std::string& settings, const VerifyOptions& options, const char* words) {
        PackData changed = *data;
        changed.settings_json = settings;
        CountedStages progress;
        const auto report = verify(*scene, *Pack::fromData(std::move(changed)), options, progress);
        ASSERT_FALSE(report) << words;
        EXPECT_NE(report.error().message.find(words), std::string::npos) << report.error().message;
        EXPECT_EQ(progress.count, 0) << words;
    };
    VerifyOptions causes{.state = "", .points = 10, .paths_max = 64, .sets = false, .causes = true};
    VerifyOptions formats{.state = "", .points = 10, .paths_max = 64, .sets = false, .formats = true};
    json denser = json::parse(data->settings_json);
    denser["lightmaps.texels_per_metre"]["value"] = 16;
    for (const VerifyOptions& options : {causes, formats}) {
        expectRefused("{}", options, "no quality");  // no level was cooked into it
        expectRefused(denser.dump(), options, "charts are not those of the pack");
    }
    causes.state = "door:front=1";
    expectRefused(data->settings_json, causes, "closed doors");
}

// As many pages of the same size, and yet other charts: causes would be told of the wrong texels.
TEST(Dissect, AnEditedLevelIsRefused) {
    LevelFile level = twoCells();
    const auto before = level.import();
    ASSERT_TRUE(before) << before.error().message;
    SilentProgress silent;
    CookStats stats;
    auto data = cookScene(*before, smallProfile(), "draft", silent, stats);
    ASSERT_TRUE(data) << data.error().message;
    const auto pack = Pack::fromData(std::move(*data));
    level.node(1)["translation"] = {0, 0, 0.5};
    const auto after = level.import();
    ASSERT_TRUE(after) << after.error().message;
    for (const bool formats : {false, true}) {
        CountedStages progress;
        const auto report =
            verify(*after, *pack,
                   {.state = "", .points = 10, .paths_max = 64, .sets = false, .causes = !formats, .formats = formats},
                   progress);
        ASSERT_FALSE(report);
        EXPECT_NE(report.error().message.find("charts are not those of the pack"), std::string::npos)
            << report.error().message;
        EXPECT_EQ(progress.count, 0);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
