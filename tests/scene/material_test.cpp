#include <fmt/format.h>
#include <scene/emission.h>
#include <scene/expectations.h>
#include <stb/stb_image_write.h>
#include <trace/ray_scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace dimmer::cook::test {
namespace {

std::vector<uint8_t> png(int width, int height, const std::vector<uint8_t>& rgba) {
    std::vector<uint8_t> bytes;
    const auto append = [](void* to, void* data, int size) {
        const auto* first = static_cast<const uint8_t*>(data);
        static_cast<std::vector<uint8_t>*>(to)->insert(static_cast<std::vector<uint8_t>*>(to)->end(), first,
                                                       first + size);
    };
    stbi_write_png_to_func(append, &bytes, width, height, 4, rgba.data(), width * 4);
    return bytes;
}

// Adds a texture of an embedded 2 x 1 image and returns its index.
int addTexture(LevelFile& level, const std::vector<uint8_t>& rgba) {
    const std::vector<uint8_t> bytes = png(2, 1, rgba);
    level.document["images"].push_back(
        {{"name", "picture"}, {"bufferView", level.addView(bytes.data(), bytes.size())}, {"mimeType", "image/png"}});
    level.document["textures"].push_back({{"source", level.document["images"].size() - 1}});
    return static_cast<int>(level.document["textures"].size()) - 1;
}

// A level whose square "poster" has the texture and coordinates 0..1.
LevelFile levelWithPoster(const json& texture_info, const std::vector<uint8_t>& rgba) {
    LevelFile level = LevelFile::withFloor();
    json info = texture_info;
    info["index"] = addTexture(level, rgba);
    const int material = level.addMaterial(
        {{"name", "picture"}, {"pbrMetallicRoughness", {{"baseColorTexture", info}, {"metallicFactor", 0}}}});
    const int mesh = level.addSquareMesh(material);
    level.primitive(mesh)["attributes"]["TEXCOORD_0"] = level.addVec2({{0, 1}, {1, 1}, {1, 0}, {0, 0}});
    level.primitive(mesh)["attributes"]["TEXCOORD_2"] = level.addVec2({{0, 0}, {0, 0}, {0.25, 0.5}, {0, 0}});
    level.addNode({{"name", "poster"}, {"mesh", mesh}});
    return level;
}

const std::vector<uint8_t> red_and_grey = {255, 0, 0, 255, 188, 188, 188, 51};

TEST(SceneMaterials, ReflectanceOfDielectricsAndMetals) {
    // scene.md: rs = s (0.04 + 0.96 / 21) = 0.0857142857 for a dielectric; rho = c (1 - rs) + rs.
    Material material;
    expectNear(material.reflectance({0, 0.5f, 0.8f}), {0.085714286f, 0.542857143f, 0.817142857f}, 1e-6f);
    material.specular = 0;
    expectNear(material.reflectance({0, 0.5f, 0.8f}), {0, 0.5f, 0.8f}, 1e-6f);
    // A metal reflects its base colour; half a metal: c = 0.25, rs = (0.0857142857 + 0.5) / 2.
    material.specular = 1;
    material.metallic = 1;
    expectNear(material.reflectance({0, 0.5f, 0.8f}), {0, 0.5f, 0.8f}, 1e-6f);
    material.metallic = 0.5f;
    const float rs = (0.0857142857f + 0.5f) / 2;
    EXPECT_NEAR(material.reflectance(glm::vec3(0.5f)).x, 0.25f * (1 - rs) + rs, 1e-6f);
    material.metallic = 0;
    EXPECT_EQ(material.reflectance(glm::vec3(1)).x, 0.99f);
}

TEST(SceneMaterials, FactorsAndExtensions) {
    LevelFile level = LevelFile::withFloor();
    level.addMaterial({{"name", "window"},
                       {"pbrMetallicRoughness", {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.25}}},
                       {"alphaMode", "BLEND"},
                       {"doubleSided", true},
                       {"emissiveFactor", {1, 0.5, 0}},
                       {"extensions",
                        {{"KHR_materials_emissive_strength", {{"emissiveStrength", 200}}},
                         {"KHR_materials_specular", {{"specularFactor", 0.5}}}}}});
    level.addMaterial({{"alphaMode", "MASK"}, {"alphaCutoff", 0.3}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    const Material& window = scene->materials[1];
    EXPECT_EQ(window.name, "window");
    expectNear(window.base_color, {0.1f, 0.2f, 0.3f});
    EXPECT_FLOAT_EQ(window.alpha, 0.4f);
    EXPECT_EQ(window.metallic, 0.25f);
    EXPECT_EQ(window.specular, 0.5f);
    EXPECT_EQ(window.alpha_mode, AlphaMode::Blend);
    EXPECT_TRUE(window.double_sided);
    expectNear(window.emission_cd_m2, {200, 100, 0});
    const Material& mask = scene->materials[2];
    EXPECT_EQ(mask.alpha_mode, AlphaMode::Opaque);  // nothing of it is cut out
    EXPECT_FLOAT_EQ(mask.alpha_cutoff, 0.3f);
    EXPECT_EQ(mask.metallic, 1.0f);  // glTF's default
    EXPECT_FALSE(mask.double_sided);
}

// A wall is one, whatever its material might do: what has no holes is opaque, and parts rooms as such.
TEST(SceneMaterials, OpaqueIsWhatLetsNothingPass) {
    LevelFile level = LevelFile::withFloor();
    for (const float alpha : {1.0f, 0.6f, 0.4f})
        for (const char* mode : {"MASK", "BLEND"})
            level.addMaterial({{"alphaMode", mode}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, alpha}}}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    std::vector<AlphaMode> found;
    for (size_t i = 1; i < scene->materials.size(); ++i) found.push_back(scene->materials[i].alpha_mode);
    const auto opaque = AlphaMode::Opaque, mask = AlphaMode::Mask, blend = AlphaMode::Blend;
    EXPECT_EQ(found, (std::vector{opaque, opaque, opaque, blend, mask, blend}));
}

TEST(SceneMaterials, FactorsOutsideTheirRange) {
    LevelFile level = LevelFile::withFloor();
    level.document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1.5, 0.5, 0.5, 1};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->materials[0].base_color.x, 1.0f);
    expectWarning(*scene, {"material 'white'", "baseColorFactor", "clamped"});

    const std::pair<const char*, json> bad[] = {{"emissiveFactor", {1, -1, 0}},
                                                {"emissiveFactor", {1e39, 0, 0}},
                                                {"alphaMode", "GLASS"},
                                                {"alphaCutoff", 1e39}};
    for (const auto& [key, value] : bad) {
        LevelFile refused = LevelFile::withFloor();
        refused.document["materials"][0][key] = value;
        SCOPED_TRACE(key);
        expectBadInput(refused.import(), {"material 'white'"});
    }
    LevelFile refused = LevelFile::withFloor();
    refused.document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 1e39, 0.5, 1};
    expectBadInput(refused.import(), {"material 'white'", "baseColorFactor"});
}

TEST(SceneMaterials, TexturesBecomeLinear) {
    const auto scene = levelWithPoster(json::object(), red_and_grey).import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->textures.size(), 1u);
    EXPECT_EQ(scene->materials[1].base_color_texture, 0u);
    const Texture& image = *scene->textures[0];
    EXPECT_EQ(image.width, 2u);
    EXPECT_EQ(image.height, 1u);
    const glm::vec4 red = image.sample({0.25f, 0.5f}), grey = image.sample({0.75f, 0.5f});  // the texels' centres
    expectNear(glm::vec3(red), {1, 0, 0});
    // IEC 61966-2-1: 188/255 = 0.737255 -> ((0.737255 + 0.055) / 1.055)^2.4 = 0.502886; alpha is linear.
    expectNear(glm::vec3(grey), glm::vec3(0.502886f), 1e-5f);
    EXPECT_FLOAT_EQ(grey.a, 0.2f);
    expectNear(glm::vec3(image.mean()), {0.751443f, 0.251443f, 0.251443f}, 1e-5f);
    EXPECT_EQ(scene->meshes[1].uv0[1], glm::vec2(1, 1));
}

TEST(SceneMaterials, SamplingIsBilinearAndRepeats) {
    using Code = glm::u8vec4;
    const Texture image{2, 2, TransferFunction::Linear, {Code(0), Code(85), Code(170), Code(255)}};  // thirds
    const auto at = [&](glm::vec2 uv) { return 3 * image.sample(uv).x; };
    EXPECT_NEAR(at({0.25f, 0.25f}), 0, 1e-5f);  // texel centres
    EXPECT_NEAR(at({0.75f, 0.25f}), 1, 1e-5f);
    EXPECT_NEAR(at({0.25f, 0.75f}), 2, 1e-5f);
    EXPECT_NEAR(at({0.5f, 0.5f}), 1.5f, 1e-5f);
    EXPECT_NEAR(at({0.375f, 0.25f}), 0.25f, 1e-5f);
    EXPECT_NEAR(at({0, 0.25f}), 0.5f, 1e-5f);  // between the last column and the first
    EXPECT_NEAR(at({-0.25f, 0.25f}), 1, 1e-5f);
    EXPECT_NEAR(at({7.75f, -3.25f}), 3, 1e-5f);
    EXPECT_TRUE(std::isfinite(image.sample({INFINITY, NAN}).x));
    EXPECT_TRUE(std::isfinite(image.sample({1e30f, -1e-30f}).x));
}

TEST(SceneMaterials, TextureTransformAndSet) {
    // rotation 90 degrees: (u, v) -> (v, -u), scaled before, moved after.
    const json transform = {{"offset", {0.5, 0.25}}, {"rotation", std::numbers::pi / 2}, {"scale", {2, 4}}};
    auto scene = levelWithPoster({{"extensions", {{"KHR_texture_transform", transform}}}}, red_and_grey).import();
    ASSERT_IMPORTED(scene);
    const glm::vec2 corner = scene->meshes[1].uv0[1];  // of (1, 1)
    EXPECT_NEAR(corner.x, 4.5f, 1e-5f);
    EXPECT_NEAR(corner.y, -1.75f, 1e-5f);

    scene = levelWithPoster({{"texCoord", 2}}, red_and_grey).import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->meshes[1].uv0[2], glm::vec2(0.25f, 0.5f));

    scene = levelWithPoster({{"texCoord", 7}}, red_and_grey).import();
    ASSERT_IMPORTED(scene);
    expectWarning(*scene, {"node 'poster'", "TEXCOORD_7"});
}

TEST(SceneMaterials, TextureTransformsOfTheWrongTypeAreRefused) {
    const std::pair<json, const char*> cases[] = {{{{"offset", {1, 2, 3}}}, "'offset'"},
                                                  {{{"offset", 1}}, "'offset'"},
                                                  {{{"offset", {"a", 0}}}, "'offset'"},
                                                  {{{"scale", "2"}}, "'scale'"},
                                                  {{{"scale", {2}}}, "'scale'"},
                                                  {{{"rotation", "90"}}, "'rotation'"},
                                                  {{{"rotation", json::array()}}, "'rotation'"},
                                                  {{{"texCoord", -1}}, "'texCoord'"},
                                                  {{{"texCoord", 0.5}}, "'texCoord'"},
                                                  {{{"texCoord", 4294967296}}, "'texCoord'"},
                                                  {{{"offset", {4294967296, 0}}}, "'offset'"},
                                                  {json::array({1}), "'KHR_texture_transform'"}};
    for (const auto& [transform, key] : cases) {
        SCOPED_TRACE(transform.dump());
        expectBadInput(levelWithPoster({{"extensions", {{"KHR_texture_transform", transform}}}}, red_and_grey).import(),
                       {"material 'picture'", key});
    }
    for (const uint64_t set : {uint64_t{4294967295}, uint64_t{4294967296}})
        expectBadInput(levelWithPoster({{"texCoord", set}}, red_and_grey).import(),
                       {"material 'picture'", "'texCoord'", std::to_string(set)});
}

TEST(SceneMaterials, MetalTexturesCountWithTheirMean) {
    LevelFile level = LevelFile::withFloor();
    const int texture = addTexture(level, {255, 0, 0, 255, 0, 0, 255, 255});
    const int half_metal = level.addMaterial(
        {{"name", "half"}, {"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", texture}}}}}});
    level.addNode({{"mesh", level.addSquareMesh(half_metal)}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_FLOAT_EQ(scene->materials[1].metallic, 0.5f);  // blue channel
    expectWarning(*scene, {"material 'half'", "metalness"});
}

const std::vector<uint8_t> red_and_blue = {255, 0, 0, 255, 0, 0, 255, 255};

// A screen that emits 4 cd/m2 times red on the left and blue on the right, with these coordinates at its corners.
LevelFile levelWithScreen(const std::vector<glm::vec2>& uvs, const json& texture_info = json::object(),
                          const std::vector<uint8_t>& rgba = red_and_blue) {
    LevelFile level = LevelFile::withFloor();
    json info = texture_info;
    info["index"] = addTexture(level, rgba);
    const int mesh = level.addSquareMesh(
        level.addMaterial({{"name", "screen"}, {"emissiveFactor", {4, 4, 4}}, {"emissiveTexture", info}}));
    level.primitive(mesh)["attributes"]["TEXCOORD_0"] = level.addVec2(uvs);
    level.addNode({{"name", "screen"}, {"mesh", mesh}});
    return level;
}

// It was the mean of the whole image, whatever of it a surface shows.
TEST(SceneMaterials, SurfacesEmitWhatTheyShowOfAnEmissiveTexture) {
    // One column: its texel's middle, or, where the image repeats, half of each.
    const std::vector<std::pair<float, glm::vec3>> columns = {{0.25f, {4, 0, 0}}, {0.75f, {0, 0, 4}}, {1, {2, 0, 2}}};
    for (const auto& [u, emission] : columns) {
        const auto scene = levelWithScreen({{u, 0}, {u, 0}, {u, 1}, {u, 1}}).import();
        ASSERT_IMPORTED(scene);
        for (uint32_t t = 0; t < 2; ++t) expectNear(emissionOf(*scene, scene->meshes[1], t), emission);
    }
    // All of it: by area half red and half blue.
    const auto whole = levelWithScreen({{0, 0}, {1, 0}, {1, 1}, {0, 1}}).import();
    ASSERT_IMPORTED(whole);
    const std::vector<uint32_t> screen = {1};
    expectNear(meanEmissionShare(*whole, screen, 1), {0.5f, 0, 0.5f}, 0.01f);  // eight parts to a side of two texels
    // The transform moves what is shown.
    const json moved = {{"extensions", {{"KHR_texture_transform", {{"offset", {0.5, 0}}}}}}};
    const auto blue = levelWithScreen({{0.25f, 0}, {0.25f, 0}, {0.25f, 1}, {0.25f, 1}}, moved).import();
    ASSERT_IMPORTED(blue);
    expectNear(emissionOf(*blue, blue->meshes[1], 0), {0, 0, 4});
    EXPECT_TRUE(blue->warnings.empty());
}

// One set of coordinates is kept.
TEST(SceneMaterials, EmissiveTexturesMappedUnlikeTheBaseColourCountWithTheirMean) {
    LevelFile level = levelWithScreen({{0.25f, 0}, {0.25f, 0}, {0.25f, 1}, {0.25f, 1}});
    json& material = level.document["materials"].back();
    material["pbrMetallicRoughness"]["baseColorTexture"] = material["emissiveTexture"];
    const auto alike = level.import();
    ASSERT_IMPORTED(alike);
    expectNear(emissionOf(*alike, alike->meshes[1], 0), {4, 0, 0});
    EXPECT_TRUE(alike->warnings.empty());
    material["emissiveTexture"]["extensions"] = {{"KHR_texture_transform", {{"offset", {0.5, 0}}}}};
    const auto apart = level.import();
    ASSERT_IMPORTED(apart);
    expectNear(emissionOf(*apart, apart->meshes[1], 0), {2, 0, 2});
    expectWarning(*apart, {"material 'screen'", "mean of its emissive"});
}

TEST(SceneMaterials, NothingShinesBehindABlackEmissiveTexture) {
    const auto scene =
        levelWithScreen({{0, 0}, {1, 0}, {1, 1}, {0, 1}}, json::object(), {0, 0, 0, 255, 0, 0, 0, 255}).import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->materials[1].emission_cd_m2, glm::vec3(0));
}

// Textures whose only image is an extension's: the factors stood for them, and nobody said so.
TEST(SceneMaterials, TexturesWithoutAReadableImageAreTold) {
    LevelFile level = levelWithScreen({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    json& material = level.document["materials"].back();
    for (const char* place : {"baseColorTexture", "metallicRoughnessTexture"})
        material["pbrMetallicRoughness"][place] = material["emissiveTexture"];
    level.document["textures"].back() = {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    for (const char* what : {"base colour", "metalness", "emissive"})
        expectWarning(*scene, {"material 'screen'", what, "no PNG or JPEG image"});
}

// The other scene's picture is missing.
TEST(SceneMaterials, ImagesOfOtherScenesAreNotWanted) {
    LevelFile level = levelWithPoster(json::object(), red_and_grey);
    level.document["images"][0] = {{"name", "picture"}, {"uri", "nowhere.png"}};
    const auto poster = level.document["nodes"].size() - 1;
    json& roots = level.document["scenes"][0]["nodes"];
    roots.erase(std::find(roots.begin(), roots.end(), json(poster)));
    level.document["scenes"].push_back({{"nodes", {poster}}});
    ASSERT_IMPORTED(level.import());
}

TEST(SceneMaterials, WithoutCoordinatesTheTexturesCornerCounts) {
    LevelFile level = levelWithPoster(json::object(), {0, 0, 0, 255, 0, 0, 0, 255});
    level.primitive(static_cast<int>(level.document["meshes"].size()) - 1)["attributes"].erase("TEXCOORD_0");
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    expectWarning(*scene, {"node 'poster'", "the texture's corner was used"});
    const RayScene rays(*scene);
    for (uint32_t t = 0; t < rays.triangles().size(); ++t)
        EXPECT_EQ(glm::vec3(rays.surfaceColor(t, 0.2f, 0.2f)) == glm::vec3(0), rays.triangles()[t].mesh == 1) << t;
}

// Programs write image/jpg and others beside the two types that glTF names: the bytes say what it is.
TEST(SceneMaterials, DataOfAnyMediaTypeIsAnImageWhereItsBytesAre) {
    LevelFile level = LevelFile::withFloor();
    // One white texel.
    const std::string png_base64 =
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8/5+hHgAHggJ/PchI7wAAAABJRU5ErkJggg==";
    level.document["textures"] = json::array({{{"source", 0}}});
    level.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    for (const char* type : {"image/png", "image/jpg", "IMAGE/PNG;charset=utf-8", ""}) {
        level.document["images"] = json::array({{{"uri", fmt::format("data:{};base64,{}", type, png_base64)}}});
        const auto scene = level.import();
        ASSERT_IMPORTED(scene);
        ASSERT_EQ(scene->textures.size(), 1u) << type;
        EXPECT_EQ(scene->textures[0]->width, 1u);
    }
}

TEST(SceneMaterials, UnusableImagesAreRefused) {
    LevelFile level = levelWithPoster(json::object(), red_and_grey);
    json& image = level.document["images"][0];
    const json good = image;
    const auto view = image["bufferView"].get<size_t>();
    image = {{"name", "picture"}, {"uri", "nowhere.png"}};
    expectBadInput(level.import(), {"material 'picture'", "nowhere.png"});
    level.document["nodes"].back().erase("mesh");  // nobody's image
    ASSERT_IMPORTED(level.import());
    EXPECT_TRUE(level.import()->textures.empty());
    level.document["nodes"].back()["mesh"] = level.document["meshes"].size() - 1;
    image = {{"name", "picture"}, {"uri", "data:image/png;base64,AAAAAAAAAAAAAAAA"}};
    expectBadInput(level.import(), {"material 'picture'", "neither PNG nor JPEG"});
    // The name of a media type is no matter; what is none of base64 is not printed whole.
    image = {{"name", "picture"}, {"uri", "data:image/jpg;base64," + std::string(5000, 'A')}};
    expectBadInput(level.import(), {"material 'picture'", "neither PNG nor JPEG"});
    EXPECT_LT(level.import().error().message.size(), 500u);
    image = {{"name", "picture"}, {"uri", "data:image/jpg," + std::string(5000, 'A')}};
    expectBadInput(level.import(), {"material 'picture'", "data URI", "base64"});
    EXPECT_LT(level.import().error().message.size(), 500u);
    image = good;
    level.document["bufferViews"][view]["byteLength"] = 40;  // ends inside the header of the pixels
    expectBadInput(level.import(), {"material 'picture'", "damaged"});
}

}  // namespace
}  // namespace dimmer::cook::test
