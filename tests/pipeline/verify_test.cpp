// The error measures by arithmetic, and what verify says of packs that are right, wrong and black.
#include <bake/test_scenes.h>
#include <format/texel.h>
#include <pipeline/cooked_level.h>
#include <pipeline/heat_map.h>
#include <pipeline/measured_light.h>
#include <pipeline/verify.h>
#include <scene/level_file.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

namespace dimmer::cook::test {
namespace {

TEST(LightError, IsWhatItsFormulaSays) {
    // Errors 0.1, 0.2, 0.3, ... 2.0 of 10 + 10 lux.
    std::vector<LightPair> pairs;
    for (int i = 1; i <= 20; ++i) pairs.push_back({10 + 2.0 * i, 10, 0});
    const ErrorFigures f = lightError(pairs, 10);
    EXPECT_EQ(f.points, 20u);
    EXPECT_NEAR(f.mean, 1.05, 1e-12);
    EXPECT_NEAR(f.p95, 1.9, 1e-12);  // the 19th of 20
    EXPECT_NEAR(f.rmse, 2 * std::sqrt(20 * 21 * 41 / 6.0 / 20) / 10, 1e-12);
    EXPECT_NEAR(f.bias, 2 * 10.5 / 10, 1e-12);
    EXPECT_EQ(f.reference_error_mean, 0);
}

TEST(LightError, TakesTheReferencesNoiseOff) {
    // A perfect pack against a noisy reference, and one that is 10 % too bright everywhere.
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0, 2);
    std::vector<LightPair> right, bright;
    for (int i = 0; i < 20000; ++i) {
        const double reference = 100 + noise(random);
        right.push_back({100, reference, 2});
        bright.push_back({110, reference, 2});
    }
    EXPECT_LT(lightError(right, 0).mean, 0.003);
    EXPECT_LT(lightError(right, 0).rmse, 0.003);
    EXPECT_NEAR(lightError(right, 0).measured_mean, 0.02 * std::sqrt(2 / std::numbers::pi), 0.0005);
    EXPECT_NEAR(lightError(bright, 0).mean, 0.1, 0.002);
    EXPECT_NEAR(lightError(bright, 0).bias, 0.1, 0.001);
}

TEST(LightError, BlackNeedsAFloor) {
    const std::array black{LightPair{0, 0, 0}, LightPair{1, 0, 0}};
    EXPECT_EQ(lightError(black, 0).points, 0u);
    EXPECT_DOUBLE_EQ(lightError(black, 4).mean, 0.125);
}

TEST(EffectError, IgnoringAnElementScoresOne) {
    const std::array pairs{LightPair{0, 10, 0.1}, LightPair{0, -5, 0.1}, LightPair{7, 0.2, 0.1}};
    const EffectFigures f = effectError(pairs);
    EXPECT_EQ(f.points, 2u);  // the third is within three standard errors of nothing
    EXPECT_NEAR(f.measured_error, 1, 1e-12);
    EXPECT_NEAR(f.bias, -5.0 / 15, 1e-12);
    EXPECT_EQ(effectError({}).points, 0u);
    EXPECT_NEAR(f.elsewhere, 6.8 / 15, 1e-12);
}

// The standard error of a ratio of sums, against the spread over many draws.
TEST(EffectError, KnowsHowMuchOtherPointsWouldSay) {
    std::mt19937 random(5);
    std::lognormal_distribution<double> light(0, 1);
    std::normal_distribution<double> wrong(0, 0.2);
    double mean = 0, squares = 0, said = 0;
    constexpr int draws = 2000;
    for (int i = 0; i < draws; ++i) {
        std::vector<LightPair> pairs;
        for (int k = 0; k < 200; ++k) {
            const double lux = light(random);
            pairs.push_back({lux * (1 + wrong(random)), lux, 0});
        }
        const EffectFigures f = effectError(pairs);
        mean += f.measured_error / draws;
        squares += f.measured_error * f.measured_error / draws;
        said += f.sampling_error / draws;
    }
    EXPECT_NEAR(said, std::sqrt(squares - mean * mean), 0.1 * said);  // to first order in 1 / points
}

// A furnace: E = pi L / (1 - rho) for every place and normal, so that what verify reports is the pack's doing.
Scene furnace() {
    Scene scene;
    scene.file = "furnace";
    addBox(scene, {1, 1.5f, 2}, addMaterial(scene, emissive(glm::vec3(3), 0.5f)));
    scene.meshes[0].light_set = 0;
    for (SceneMesh& mesh : scene.meshes) mesh.light_set = 0;
    scene.light_sets = {{"glow", 1}};
    return scene;
}

VerifyOptions quick() {
    return {.state = "", .points = 60, .paths_max = 2048, .seed = 1, .sets = true};
}

TEST(Verify, ARightPackIsFoundRight) {
    const Scene scene = furnace();
    const auto pack = cooked(scene, "draft");
    ASSERT_TRUE(pack);
    SilentProgress progress;
    const auto report = verify(scene, *pack, quick(), progress);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->surface.points, 60u);
    EXPECT_NEAR(report->floor_lux, 0.01 * std::numbers::pi * 3 / 0.5, 0.02 * report->floor_lux);
    EXPECT_LE(report->surface.mean, 0.03);
    EXPECT_LE(report->tilted.mean, 0.05);
    ASSERT_EQ(report->sets.size(), 1u);
    EXPECT_LE(report->sets[0].effect.error, 0.05);
    for (const VerifyPoint& p : report->points) {
        EXPECT_NEAR(glm::length(p.tilted), 1, 1e-5);
        EXPECT_GE(glm::dot(p.tilted, p.frame.normal), 0.4999f);
    }
}

// Every figure is that of the places listed with it, whatever lists them.
TEST(Verify, ListsThePlacesBehindItsFigures) {
    Scene scene = furnace();
    scene.dynamic_places.emplace_back();  // asks for a global grid
    const auto pack = cooked(scene, "draft");
    ASSERT_TRUE(pack);
    SilentProgress progress;
    const auto report = verify(scene, *pack, quick(), progress);
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_GT(report->grid.points, 0u);
    std::map<std::string, std::vector<LightPair>> by_kind;
    for (const MeasuredPlace& p : report->places) {
        EXPECT_LE(glm::length(glm::max(glm::abs(p.position_m) - glm::vec3(1, 1.5f, 2), 0.0f)), 1e-4f);  // in the box
        EXPECT_NEAR(glm::length(p.normal), 1, 1e-5);
        by_kind[p.kind].push_back(p.light);
    }
    EXPECT_EQ(by_kind.size(), 3u);  // no models
    for (const auto& [kind, figures] :
         {std::pair("surface", report->surface), {"tilted", report->tilted}, {"grid", report->grid}}) {
        EXPECT_EQ(by_kind[kind].size(), figures.points) << kind;
        const ErrorFigures listed = lightError(by_kind[kind], report->floor_lux);
        EXPECT_DOUBLE_EQ(listed.measured_mean, figures.measured_mean) << kind;
        EXPECT_DOUBLE_EQ(listed.bias, figures.bias) << kind;
        EXPECT_GT(listed.measured_mean, 0) << kind;
    }
}

// The same pack with half the light in its records: 50 % off, and said so.
TEST(Verify, AWrongPackIsFoundWrong) {
    const Scene scene = furnace();
    const auto right = cooked(scene, "draft");
    ASSERT_TRUE(right);
    PackData data = right->data();
    data.exposure *= 2;
    const auto pack = Pack::fromData(std::move(data));
    ASSERT_TRUE(pack) << pack.error().message;
    SilentProgress progress;
    const auto report = verify(scene, *pack, quick(), progress);
    ASSERT_TRUE(report) << report.error().message;
    // |E - E_ref| / (E_ref + floor) = 0.5 / 1.01
    EXPECT_NEAR(report->surface.mean, 0.5 / 1.01, 0.02);
    EXPECT_NEAR(report->surface.bias, -0.5, 0.02);
    EXPECT_NEAR(report->sets[0].effect.error, 0.5, 0.02);
    EXPECT_TRUE(report->converged);
}

// The standard error falls with the root of the paths: a sixteenth of them, four times the noise.
// A black hall with a hole of 10 cm in its ceiling, under a sky: one path in some 3,000 finds it. That none of the
// first did is no darkness where a pack has light; where it has none either they are enough.
TEST(MeasuredLight, WhatNoPathFoundYetIsNotKnown) {
    Scene scene;
    scene.sky_radiance_cd_m2 = glm::vec3(10000);
    const uint32_t black = addMaterial(scene, lambert(0));
    addFloor(scene, 4, black);
    for (const float side : {-1.0f, 1.0f}) {
        addQuad(scene, "wall", {side * 4, 1.5f, 0}, {0, 1.5f, 0}, {0, 0, -side * 4}, black);
        addQuad(scene, "wall", {0, 1.5f, side * 4}, {0, 1.5f, 0}, {side * 4, 0, 0}, black);
        addQuad(scene, "ceiling", {side * 2.025f, 3, 0}, {1.975f, 0, 0}, {0, 0, 4}, black);
        addQuad(scene, "ceiling", {0, 3, side * 2.025f}, {0.05f, 0, 0}, {0, 0, 1.975f}, black);
    }
    const RayScene rays(scene);
    const ReferenceTracer tracer(rays, {});
    const std::vector<ReferencePoint> points(2, {{0.4f, 0, 0.3f}, {0, 1, 0}, {0, 1, 0}});
    // The hole is small beside its distance d: L A cos^2 / d^2.
    const double d2 = 9 + 0.25, expected = 10000 * 0.01 * (9 / d2) / d2;
    const std::array<double, 2> of_pack{expected, 0};
    constexpr uint32_t most = 1 << 18;
    SilentProgress progress;
    const Measured m = measure(tracer, points, of_pack, 0.01 * expected, most, progress);
    EXPECT_EQ(m.estimates[0].paths(), most);
    const ReferenceValue found = m.estimates[0].value();
    EXPECT_NEAR(static_cast<double>(found.irradiance_lux.y), expected,
                4 * static_cast<double>(found.standard_error_lux.y));
    EXPECT_LT(static_cast<double>(found.standard_error_lux.y), 0.2 * expected);
    EXPECT_LE(m.estimates[1].paths(), ReferenceTarget{}.paths_min);
}

// A floor under a sheet is no place to ask for light, however close that lies; in the floor's own plane it may be the
// floor itself, in pieces that differ by rounding.
TEST(MeasuredLight, BelowASheetIsHidden) {
    for (const float height_m : {0.0f, 1e-4f, 3.5e-4f, 7e-4f}) {
        Scene scene;
        addFloor(scene, 1, addMaterial(scene, lambert(0.5f)));
        Material paper = lambert(0.5f);
        paper.double_sided = true;
        addFloor(scene, 0.5f, addMaterial(scene, std::move(paper)), height_m);
        const RayScene rays(scene);
        const TangentFrame frame{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
        EXPECT_EQ(hidden(rays, {0.1f, 0, 0.2f}, frame, 1), height_m > 3e-4f) << height_m;
        EXPECT_FALSE(hidden(rays, {0.7f, 0, 0.2f}, frame, 1)) << height_m;
    }
}

TEST(Verify, FewPathsAreFewForSetsToo) {
    const Scene scene = furnace();
    const auto pack = cooked(scene, "draft");
    ASSERT_TRUE(pack);
    const RayScene rays(scene);
    const auto points = choosePoints(*pack, rays, {}, 60, 1);
    ASSERT_EQ(points.size(), 60u);
    SilentProgress progress;
    const auto few = setEffect(rays, *pack, points, 0, 1, progress, 16);
    const auto more = setEffect(rays, *pack, points, 0, 1, progress, 256);
    ASSERT_TRUE(few && more);
    ASSERT_GT(more->reference_noise, 0);
    EXPECT_NEAR(few->reference_noise / more->reference_noise, 4, 2);
}

// A set that a game can only dim: without a state, pack and reference show it at its maximum.
TEST(Verify, ASetOfSmallMaximumIsHeldAgainstTheSame) {
    Scene scene = furnace();
    scene.light_sets[0].max_weight = 0.25f;
    const auto pack = cooked(scene, "draft");
    ASSERT_TRUE(pack);
    SilentProgress progress;
    const auto report = verify(scene, *pack, quick(), progress);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_LE(report->surface.mean, 0.03);
    ASSERT_EQ(report->sets.size(), 1u);
    EXPECT_LE(report->sets[0].effect.error, 0.05);
}

TEST(Verify, AnswersWhatItCannotMeasure) {
    const Scene scene = furnace();
    const auto pack = cooked(scene, "draft");
    ASSERT_TRUE(pack);
    SilentProgress progress;
    VerifyOptions unknown = quick();
    unknown.state = "glwo=1";
    const auto no_set = verify(scene, *pack, unknown, progress);
    ASSERT_FALSE(no_set);
    EXPECT_NE(no_set.error().message.find("did you mean \"glow\""), std::string::npos) << no_set.error().message;
    Scene other = scene;
    other.light_sets[0].name = "gleam";
    EXPECT_EQ(verify(other, *pack, quick(), progress).error().code, ErrorCode::BadInput);
    Scene door = scene;  // of the set's name
    for (SceneMesh& mesh : door.meshes) mesh.light_set.reset();
    door.light_sets.clear();
    door.doors = {{.name = "glow"}};
    const auto other_kind = verify(door, *pack, quick(), progress);
    ASSERT_FALSE(other_kind);
    EXPECT_EQ(other_kind.error().code, ErrorCode::BadInput);
    Scene black = scene;
    for (Material& m : black.materials) m.emission_cd_m2 = glm::vec3(0);
    const auto dark = cooked(black, "draft");
    ASSERT_TRUE(dark);
    EXPECT_EQ(verify(black, *dark, quick(), progress).error().code, ErrorCode::BadInput);
}

TEST(ReferenceState, ReadsSetsAndDoors) {
    Scene scene;
    scene.light_sets = {{"hall", 1}, {"alarm", 1}};
    scene.doors = {{"front", false}, {"back", true}};
    const auto state = readReferenceState(scene, "alarm=1/0.5/0.25,door:front=1,all=0.5");
    ASSERT_TRUE(state) << state.error().message;
    EXPECT_EQ(state->set_weights[0], glm::vec3(0.5f));
    EXPECT_EQ(state->set_weights[1], glm::vec3(1, 0.5f, 0.25f));
    EXPECT_EQ(state->door_open, (std::vector<bool>{true, false}));
    scene.light_sets[1].max_weight = 0.5f;
    EXPECT_EQ(readReferenceState(scene, "")->set_weights, (std::vector{glm::vec3(1), glm::vec3(0.5f)}));
    for (const char* bad : {"hall=inf", "all=1e38", "hall=nan", "hall=-1", "hall=1.5", "alarm=0.6", "all=1"}) {
        const auto refused = readReferenceState(scene, bad);
        ASSERT_FALSE(refused) << bad;
        EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument) << bad;
    }
    EXPECT_EQ(readReferenceState(scene, "door:front=0.5").error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(readReferenceState(scene, "door:side=1").error().code, ErrorCode::NotFound);

    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addFloor(scene, 1, white).door = 0;
    addFloor(scene, 1, white).door = 1;
    addFloor(scene, 1, white);
    const Scene open = sceneInState(scene, *state);
    ASSERT_EQ(open.meshes.size(), 2u);
    EXPECT_EQ(open.meshes[0].door, 1u);
}

TEST(HeatMap, WritesOnePicturePerPage) {
    const Scene scene = furnace();
    const auto pack = cooked(scene, "draft");
    ASSERT_TRUE(pack);
    SilentProgress progress;
    VerifyOptions options = quick();
    options.sets = false;
    const auto report = verify(scene, *pack, options, progress);
    ASSERT_TRUE(report);
    const TemporaryFolder folder;
    const auto heat = folder.path / "new";
    std::filesystem::create_directory(heat);
    for (const char* name : {"page_7.png", "page_1.jpg"}) std::ofstream(heat / name) << "of an earlier run";
    ASSERT_TRUE(writeHeatMaps(heat, *pack, "1234", *report, "all=1"));
    EXPECT_FALSE(std::filesystem::exists(heat / "page_7.png"));
    EXPECT_TRUE(std::filesystem::exists(heat / "page_1.jpg"));  // nobody's
    std::ifstream index(heat / "heat_maps.json");
    const nlohmann::json wanted = {{"pack_id", "1234"}, {"state", "all=1"}, {"pages", pack->pageCount()}};
    EXPECT_EQ(nlohmann::json::parse(index, nullptr, false), wanted);
    for (uint32_t page = 0; page < pack->pageCount(); ++page)
        EXPECT_GT(std::filesystem::file_size(folder.path / "new" / ("page_" + std::to_string(page) + ".png")), 100u);
    EXPECT_EQ(writeHeatMaps("/proc/no/such/place", *pack, "", *report, "").error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace dimmer::cook::test
