// IES LM-63 profiles: the format's variants, its symmetries, bad files; and EXT_lights_ies in a level.
#include <fmt/format.h>
#include <scene/expectations.h>
#include <scene/ies.h>

#include <array>
#include <cmath>
#include <fstream>
#include <random>

namespace dimmer::cook::test {
namespace {

constexpr double rad_per_deg = 3.14159265358979 / 180;

// The unit vector of two photometric angles, as EXT_lights_ies maps them: nadir -Z, 0 degrees +X.
glm::vec3 towards(double vertical_deg, double horizontal_deg) {
    const double v = vertical_deg * rad_per_deg, h = horizontal_deg * rad_per_deg;
    return glm::dvec3(std::sin(v) * std::cos(h), std::sin(v) * std::sin(h), -std::cos(v));
}

std::string numbers(const std::vector<double>& values) {
    return fmt::format("{}\n", fmt::join(values, " "));
}

struct Ies {
    std::string header = "IESNA:LM-63-2002\n[TEST] none\n";
    std::string tilt = "TILT=NONE\n";
    std::string_view type = "1";
    double multiplier = 1, ballast = 1, second = 1;
    std::vector<double> vertical = {0, 45, 90}, horizontal = {0};
    std::vector<double> candela = {100, 60, 10};

    std::string text() const {
        return header + tilt +
               fmt::format("1 -1 {} {} {} {} 2 0 0 0\n{} {} 20\n", multiplier, vertical.size(), horizontal.size(), type,
                           ballast, second) +
               numbers(vertical) + numbers(horizontal) + numbers(candela);
    }
};

LightProfile parsed(const std::string& text) {
    auto result = parseLightProfile(text, "lamp.ies");
    EXPECT_TRUE(result.has_value()) << result.error().message;
    return result ? result->profile : LightProfile();
}

double candelaAt(const LightProfile& p, double vertical_deg, double horizontal_deg) {
    return static_cast<double>(p.peak_cd * p.shareTowards(towards(vertical_deg, horizontal_deg)));
}

// Float angles are good to 1e-5 degrees; values here change by at most a few candela per degree.
constexpr double tolerance_cd = 1e-3;

// Cones about the brightest, outside of which all is darker than a half of the peak, a fifth and so on.
TEST(SceneIesFile, NarrowBeamsAreFound) {
    const auto degrees = [](float cosine) { return std::acos(static_cast<double>(cosine)) / rad_per_deg; };
    Ies narrow;
    narrow.vertical = {0, 4, 8, 12, 40, 90};
    narrow.candela = {1000, 1000, 300, 70, 3, 0};
    const LightProfile beam = parsed(narrow.text());
    expectNear(beam.beam_axis, {0, 0, -1});
    // A half within the angle that follows 4 degrees, and so on; what is below a hundredth reaches too far to be a
    // beam.
    std::vector<double> found;
    for (const float cosine : beam.beam_cos) found.push_back(degrees(cosine));
    const std::array wanted_deg = {8.0, 12.0, 40.0};
    ASSERT_EQ(found.size(), wanted_deg.size());
    for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[i], wanted_deg[i], 0.01);

    Ies aside = narrow;  // one of four horizontal angles, 60 degrees from the nadir
    aside.vertical = {0, 55, 60, 65, 90};
    aside.horizontal = {0, 80, 90, 100, 360};
    aside.candela = {};
    for (int h = 0; h < 5; ++h)
        for (int v = 0; v < 5; ++v) aside.candela.push_back(h == 2 && v == 2 ? 1000 : 0);
    const LightProfile to_y = parsed(aside.text());
    EXPECT_LT(glm::distance(to_y.beam_axis, towards(60, 90)), 0.05f);
    ASSERT_EQ(to_y.beam_cos.size(), 1u);
    // Its corners are 5 degrees up and 10 aside.
    EXPECT_NEAR(degrees(to_y.beam_cos[0]), 10, 2.5);

    EXPECT_TRUE(parsed(Ies().text()).beam_cos.empty());  // 60 of 100 at 45 degrees
}

TEST(SceneIesFile, AllFiveHeaders) {
    for (const char* header : {"", "my lamp\nsome label\n", "IESNA91\n[TEST] x\n", "IESNA:LM-63-1995\n[LUMCAT] y\n",
                               "IESNA:LM-63-2002\n[TEST] x\n[MORE] z\n", "IES:LM-63-2019\r\n[TESTLAB] x\r\n"}) {
        SCOPED_TRACE(header);
        Ies ies;
        ies.header = header;
        ies.second = 0.5;
        const LightProfile p = parsed(ies.text());
        // The second factor counts up to LM-63-1991 alone; later it is for "future use", or a code.
        const std::string_view h(header);
        const double factor = h.starts_with("IESNA:") || h.starts_with("IES:") ? 1 : 0.5;
        EXPECT_NEAR(candelaAt(p, 0, 0), 100 * factor, tolerance_cd);
        EXPECT_NEAR(candelaAt(p, 22.5, 200), 80 * factor, tolerance_cd);
        EXPECT_NEAR(candelaAt(p, 81, 77), 20 * factor, tolerance_cd);
    }
}

// Some editors begin a file with a byte-order mark, and old systems end it with a mark of its end.
TEST(SceneIesFile, MarksAreNoPartOfIt) {
    Ies ies;
    ies.second = 0.5;
    EXPECT_NEAR(candelaAt(parsed("\xef\xbb\xbf" + ies.text() + "\n\x1a"), 0, 0), 100, tolerance_cd);
}

TEST(SceneIesFile, FactorsMultiplyAndOutsideIsDark) {
    Ies ies;
    ies.multiplier = 3;
    ies.ballast = 0.9;
    const LightProfile p = parsed(ies.text());
    EXPECT_NEAR(candelaAt(p, 45, 0), 60 * 2.7, tolerance_cd);
    EXPECT_FLOAT_EQ(p.peak_cd, 270);
    EXPECT_EQ(candelaAt(p, 90.1, 0), 0);
    EXPECT_EQ(candelaAt(p, 180, 0), 0);
    ies.vertical = {90, 120, 180};  // an uplight
    EXPECT_EQ(candelaAt(parsed(ies.text()), 0, 0), 0);
    EXPECT_NEAR(candelaAt(parsed(ies.text()), 150, 0), 35 * 2.7, tolerance_cd);
}

TEST(SceneIesFile, LayoutIsFree) {
    Ies ies;
    ies.vertical = {0, 90};
    ies.candela = {100, 10};
    std::string text = ies.text();
    const size_t data = text.find("1 -1");
    for (size_t i = data; i < text.size(); ++i)
        if (text[i] == ' ') text[i] = i % 2 ? '\n' : ',';
    EXPECT_NEAR(candelaAt(parsed(text), 45, 0), 55, tolerance_cd);
}

// Columns whose candela is 10 + their angle: what a direction gets is 10 + the angle that it folds back to.
struct Symmetry {
    const char* name;
    std::vector<double> horizontal;
    double (*folded)(double);
};

TEST(SceneIesFile, SymmetriesUnfold) {
    const Symmetry symmetries[] = {
        {"around", {0}, [](double) { return 0.0; }},
        {"quadrants", {0, 30, 90}, [](double h) { return std::abs(std::remainder(h, 180.0)); }},
        {"halves", {0, 20, 90, 180}, [](double h) { return std::abs(std::remainder(h, 360.0)); }},
        {"none", {0, 45, 180, 360}, [](double h) { return h; }},
        {"front", {90, 120, 270}, [](double h) { return h >= 90 && h <= 270 ? h
                                                        : h < 90            ? 180 - h
                                                                            : 540 - h; }},
    };
    for (const Symmetry& s : symmetries) {
        SCOPED_TRACE(s.name);
        Ies ies;
        ies.vertical = {0, 180};
        ies.horizontal = s.horizontal;
        ies.candela.clear();
        for (const double h : s.horizontal) ies.candela.insert(ies.candela.end(), {10 + h, 10 + h});
        const LightProfile p = parsed(ies.text());
        for (double h = 0.5; h < 360; h += 7.25) EXPECT_NEAR(candelaAt(p, 60, h), 10 + s.folded(h), 0.01) << h;
    }
}

// A full circle without its last column: from the last angle on to the first.
TEST(SceneIesFile, AnOpenCircleIsClosed) {
    Ies ies;
    ies.vertical = {0, 180};
    ies.horizontal = {0, 90, 180, 270};
    ies.candela = {10, 10, 20, 20, 30, 30, 40, 40};
    const LightProfile p = parsed(ies.text());
    EXPECT_NEAR(candelaAt(p, 90, 225), 35, 0.01);
    EXPECT_NEAR(candelaAt(p, 90, 315), 25, 0.01);
}

// I = I0 cos: a flux of pi I0. Chords of the cosine over 5 degrees lie (5 degrees)^2 / 12 = 0.06 % below it on average.
TEST(SceneIesFile, ALambertianProfileHasItsFlux) {
    Ies ies;
    ies.vertical.clear();
    ies.candela.clear();
    for (int v = 0; v <= 90; v += 5) {
        ies.vertical.push_back(v);
        ies.candela.push_back(200 * std::cos(v * rad_per_deg));
    }
    const LightProfile p = parsed(ies.text());
    double flux = 0;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) flux += candelaAt(p, std::acos(1 - (i + 0.5) / n) / rad_per_deg, 33) * 2 * M_PI / n;
    EXPECT_NEAR(flux, 200 * M_PI, 0.001 * 200 * M_PI);
}

TEST(SceneIesFile, TiltIsReadPastAndSaidSo) {
    Ies ies;
    EXPECT_TRUE(parseLightProfile(ies.text(), "lamp.ies")->notes.empty());
    for (const char* tilt : {"TILT=INCLUDE\n1\n3\n0 90 180\n1 .9 .8\n", "TILT=lamp.tlt\n"}) {
        ies.tilt = tilt;
        const auto result = parseLightProfile(ies.text(), "lamp.ies");
        ASSERT_TRUE(result.has_value()) << result.error().message;
        ASSERT_EQ(result->notes.size(), 1u);
        EXPECT_THAT(result->notes[0], testing::HasSubstr("lamp.ies:3"));
        EXPECT_FLOAT_EQ(result->profile.peak_cd, 100);
    }
}

TEST(SceneIesFile, BadFilesAreRefusedWithTheirLine) {
    struct Bad {
        const char* name;
        void (*apply)(Ies&);
        const char* message;
    };
    const Bad bad[] = {
        {"version", [](Ies& i) { i.header = "IESNA:LM-63-2049\n"; }, "lamp.ies:1: an unknown LM-63 version"},
        {"no tilt", [](Ies& i) { i.tilt = ""; }, "TILT="},
        {"empty tilt", [](Ies& i) { i.tilt = "TILT=\n"; }, "lamp.ies:3: TILT says nothing"},
        {"tilt factors", [](Ies& i) { i.tilt = "TILT=INCLUDE\n1\n2\n0 90\n1 -1\n"; }, "lamp.ies:7: a tilt factor"},
        {"type B", [](Ies& i) { i.type = "2"; }, "lamp.ies:4: is type B"},
        {"type", [](Ies& i) { i.type = "7"; }, "lamp.ies:4: the photometric type"},
        {"no number", [](Ies& i) { i.type = "C"; }, "lamp.ies:4: 'C' is not a number"},
        {"nan", [](Ies& i) { i.type = "nan"; }, "lamp.ies:4"},
        {"half a type", [](Ies& i) { i.type = "1.5"; }, "whole number"},
        {"multiplier", [](Ies& i) { i.multiplier = -1; }, "the candela multiplier"},
        {"nothing", [](Ies& i) { i.multiplier = 0; }, "the largest intensity is 0"},
        {"overflow", [](Ies& i) { i.multiplier = 1e30, i.candela[0] = 1e30; }, "the largest intensity"},
        {"order",
         [](Ies& i) {
             i.vertical = {0, 90, 45};
         },
         "lamp.ies:6: a vertical angle does not exceed"},
        {"repeated",
         [](Ies& i) {
             i.vertical = {0, 45, 45};
         },
         "lamp.ies:6"},
        {"angle",
         [](Ies& i) {
             i.vertical = {0, 45, 200};
         },
         "lamp.ies:6: a vertical angle is 200"},
        {"horizontal",
         [](Ies& i) {
             i.horizontal = {0, 45}, i.candela.resize(6);
         },
         "lamp.ies:7: horizontal angles"},
        {"one other", [](Ies& i) { i.horizontal = {30}; }, "lamp.ies:7: horizontal angles"},
        {"negative", [](Ies& i) { i.candela[1] = -5; }, "lamp.ies:8: a candela value"},
        {"too few", [](Ies& i) { i.candela.pop_back(); }, "lamp.ies:8: the file ends"},
        {"too many values", [](Ies& i) { i.candela.push_back(5); }, "lamp.ies:8: '5' follows the last candela value"},
        {"too many angles", [](Ies& i) { i.vertical.resize(5000); }, "the number of vertical angles is 5000"},
    };
    for (const Bad& b : bad) {
        Ies ies;
        b.apply(ies);
        const auto result = parseLightProfile(ies.text(), "lamp.ies");
        ASSERT_FALSE(result.has_value()) << b.name;
        EXPECT_EQ(result.error().code, ErrorCode::BadInput);
        EXPECT_THAT(result.error().message, testing::HasSubstr(b.message)) << b.name;
    }
    for (const char* text : {"", "\n\n", "TILT=NONE", "hello"})
        EXPECT_FALSE(parseLightProfile(text, "lamp.ies").has_value()) << text;
}

TEST(SceneIesFile, MarksBehindTheLastValueAreNone) {
    for (const char* mark : {"\x1a", "[EOF]", "\r\n[END] of file\r\n"})
        EXPECT_TRUE(parseLightProfile(Ies().text() + mark, "lamp.ies").has_value()) << mark;
}

// Bytes changed, removed and cut off at random: a usable profile or a message with its place.
TEST(SceneIesFile, DamagedFilesNeverCrash) {
    std::mt19937 random(11);
    Ies ies;
    ies.tilt = "TILT=INCLUDE\n1\n2\n0 90\n1 .9\n";
    ies.horizontal = {0, 45, 90};
    ies.candela = {100, 50, 10, 90, 40, 5, 80, 30, 0};
    const std::string good = ies.text();
    int refused = 0;
    for (int i = 0; i < 1500; ++i) {
        std::string text = good;
        for (uint32_t edits = 1 + random() % 3; edits > 0 && !text.empty(); --edits) {
            const size_t at = random() % text.size();
            switch (random() % 4) {
                case 0:
                    text[at] = static_cast<char>(random());
                    break;
                case 1:
                    text.erase(at, 1 + random() % 8);
                    break;
                case 2:
                    text.insert(at, std::string(1 + random() % 3, "0123456789.-+eE \n,"[random() % 18]));
                    break;
                default:
                    if (random() % 8 == 0) text.resize(at);
            }
        }
        const auto result = parseLightProfile(text, "lamp.ies");
        if (!result) {
            ++refused;
            EXPECT_EQ(result.error().message.find("lamp.ies:"), 0u) << result.error().message;
            continue;
        }
        for (double v = 0; v <= 180; v += 30)
            for (double h = 0; h < 360; h += 50) {
                const float share = result->profile.shareTowards(towards(v, h));
                EXPECT_TRUE(share >= 0 && share <= 1) << text;
            }
    }
    EXPECT_GT(refused, 300);
    EXPECT_LT(refused, 1450);
}

// --- In a level

json& profiles(LevelFile& level) {
    level.document["extensionsUsed"] = {"EXT_lights_ies"};
    level.document["extensionsRequired"] = {"EXT_lights_ies"};
    return level.document["extensions"]["EXT_lights_ies"]["lights"];
}

Ies halfLit() {
    Ies ies;  // 200 cd towards +X, falling to 100 cd towards -X
    ies.vertical = {0, 180};
    ies.horizontal = {0, 180};
    ies.candela = {200, 200, 100, 100};
    return ies;
}

int addIesNode(LevelFile& level, const json& values, const json& more = json::object()) {
    json node = {{"name", "lamp"}, {"translation", {1, 2, 3}}, {"extensions", {{"EXT_lights_ies", values}}}};
    node.update(more);
    return level.addNode(node);
}

double candelaTowards(const PunctualLight& light, glm::vec3 world) {
    return static_cast<double>(light.intensity.y *
                               light.profile->shareTowards(light.profile_from_world * glm::normalize(world)));
}

TEST(SceneIes, FromABufferViewAndADataUri) {
    const std::string text = halfLit().text();
    LevelFile level = LevelFile::withFloor();
    profiles(level).push_back(
        {{"bufferView", level.addView(text.data(), text.size())}, {"mimeType", "application/x-ies-lm-63"}});
    // "TILT=NONE ..." by hand: 1 lamp of 50 cd all around.
    profiles(level).push_back({{"uri",
                                "data:application/x-ies-lm-63;base64,"
                                "VElMVD1OT05FCjEgLTEgMSAyIDEgMSAyIDAgMCAwCjEgMSAyMAowIDE4MAowCjUwIDUwCg=="}});
    addIesNode(level, {{"light", 0}, {"multiplier", 2}, {"color", {1, 0.5, 3}}},
               {{"extras", {{"dimmer_light_set", "hall"}, {"dimmer_bake", "full"}}}});
    addIesNode(level, {{"light", 1}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->lights.size(), 2u);
    const PunctualLight& lamp = scene->lights[0];
    EXPECT_EQ(lamp.type, LightType::Point);
    EXPECT_EQ(lamp.node, "lamp");
    EXPECT_EQ(lamp.position_m, glm::vec3(1, 2, 3));
    EXPECT_EQ(lamp.bake, BakeMode::Full);
    EXPECT_EQ(lamp.light_set, 0u);
    expectNear(lamp.intensity, {400, 200, 400}, 1e-3f);  // the colour is clamped to 1
    // 0 degrees is the node's +X, and the angle turns about its +Z.
    EXPECT_NEAR(candelaTowards(lamp, {1, 0, 0}), 200, 0.01);
    EXPECT_NEAR(candelaTowards(lamp, {0, 1, 0}), 150, 0.01);
    EXPECT_NEAR(candelaTowards(lamp, {-1, 0, 0}), 100, 0.01);
    EXPECT_NEAR(candelaTowards(scene->lights[1], {0.3f, -0.5f, 1}), 50, 0.01);
}

TEST(SceneIes, TurnsAndMirrorsWithItsNode) {
    Ies down;  // 100 cd down, nothing to the sides; a quarter of the circle differs
    down.vertical = {0, 90};
    down.horizontal = {0, 90, 180, 360};
    down.candela = {100, 0, 100, 40, 100, 0, 100, 0};
    const std::string text = down.text();
    LevelFile level = LevelFile::withFloor();
    profiles(level).push_back({{"bufferView", level.addView(text.data(), text.size())}});
    const double half = std::sqrt(0.5);
    addIesNode(level, {{"light", 0}}, {{"rotation", {-half, 0, 0, half}}});  // -Z to -Y, +Y to -Z
    addIesNode(level, {{"light", 0}}, {{"scale", {2, -2, 2}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_NEAR(candelaTowards(scene->lights[0], {0, -1, 0}), 100, 0.01);
    EXPECT_NEAR(candelaTowards(scene->lights[0], {0, 0, -1}), 40, 0.01);
    EXPECT_NEAR(candelaTowards(scene->lights[0], {1, 0, 0}), 0, 0.01);
    expectNear(scene->lights[0].direction, {0, -1, 0});
    EXPECT_NEAR(candelaTowards(scene->lights[1], {0, 0, -1}), 100, 0.01);
    EXPECT_NEAR(candelaTowards(scene->lights[1], {0, -1, 0}), 40, 0.01);
    EXPECT_NEAR(candelaTowards(scene->lights[1], {0, 1, 0}), 0, 0.01);
}

TEST(SceneIes, AFileBesideTheLevelAndAPunctualFallback) {
    const TemporaryFolder folder;
    const std::string profile = halfLit().text();
    folder.write("my lamp.ies", profile.data(), profile.size());
    LevelFile level = LevelFile::withFloor();
    level.addLight("lamp", {{"type", "spot"}, {"spot", json::object()}, {"intensity", 7}},
                   {{"dimmer_light_set", "hall"}});
    profiles(level).push_back({{"uri", "my%20lamp.ies"}});
    level.node(1)["extensions"]["EXT_lights_ies"] = {{"light", 0}};
    const std::string text = level.gltfText();
    auto scene = importLevel(folder.write("level.gltf", text.data(), text.size()));
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->lights.size(), 1u);
    EXPECT_EQ(scene->lights[0].type, LightType::Point);
    EXPECT_EQ(scene->lights[0].intensity, glm::vec3(200));
    EXPECT_EQ(scene->lights[0].light_set, 0u);

    folder.write("my lamp.ies", profile.data(), profile.size() / 2);
    scene = importLevel(folder.path / "level.gltf");
    ASSERT_FALSE(scene.has_value());
    EXPECT_EQ(scene.error().code, ErrorCode::BadInput);
    EXPECT_THAT(scene.error().message, testing::HasSubstr("my lamp.ies:"));
}

TEST(SceneIes, BadUsesAreRefused) {
    const std::string text = halfLit().text();
    const auto attempt = [&](const json& values, const json& light) {
        LevelFile level = LevelFile::withFloor();
        level.addView(text.data(), text.size());
        profiles(level).push_back(light);
        addIesNode(level, values);
        return level.import();
    };
    const int view = LevelFile::withFloor().addView(text.data(), text.size());
    const json good = {{"bufferView", view}};
    ASSERT_IMPORTED(attempt({{"light", 0}}, good));
    for (const json& values : {json::object(), json{{"light", 1}}, json{{"light", -1}}, json{{"light", "a"}},
                               json{{"light", 0}, {"multiplier", -1}}, json{{"light", 0}, {"multiplier", "x"}},
                               json{{"light", 0}, {"multiplier", 1e38}}, json{{"light", 0}, {"color", {1, 1}}},
                               json{{"light", 0}, {"color", {1, -1, 1}}}, json{{"light", 0}, {"color", "red"}}})
        expectBadInput(attempt(values, good), {"node 'lamp'"});
    for (const json& light : {json::object(), json{{"bufferView", 99}}, json{{"bufferView", -1}},
                              json{{"uri", "no.ies"}}, json{{"uri", "data:text/plain,hello"}}, json{{"bufferView", 0}}})
        expectBadInput(attempt({{"light", 0}}, light), {"light profile 0"});
}

}  // namespace
}  // namespace dimmer::cook::test
