// dimmer_sky_image: both file formats, the rule for its scale, and damaged files.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <scene/expectations.h>
#include <scene/sky.h>

#include <fstream>
#include <random>

namespace dimmer::cook::test {
namespace {

// Uncompressed Radiance scanlines: mantissas and a shared exponent, value = m * 2^(e - 136).
std::string radianceFile(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 4>>& rgbe) {
    std::string file =
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " + std::to_string(width) + "\n";
    for (const auto& texel : rgbe) file.append(reinterpret_cast<const char*>(texel.data()), 4);
    return file;
}

// Run-length encoded, as every tool writes it: all texels 2 0.5 0.25.
std::string radianceRuns(uint8_t width, uint32_t height) {
    std::string file = radianceFile(width, height, {});
    for (uint32_t y = 0; y < height; ++y) {
        file += {2, 2, 0, static_cast<char>(width)};
        for (const uint8_t value : {128, 32, 16, 130})
            file += {static_cast<char>(128 + width), static_cast<char>(value)};
    }
    return file;
}

// `window_x`, `window_y`: where the data window begins. `display`: where the picture lies, if not there.
void writeOpenExr(const std::filesystem::path& path, int width, int height, const std::vector<glm::vec4>& rgba,
                  int window_x = 0, int window_y = 0, std::optional<Imath::Box2i> display = {},
                  std::optional<Imf::Chromaticities> primaries = {}) {
    const Imath::Box2i window({window_x, window_y}, {window_x + width - 1, window_y + height - 1});
    Imf::Header header(display.value_or(window), window);
    if (primaries) Imf::addChromaticities(header, *primaries);
    Imf::FrameBuffer frame;
    for (int c = 0; const char* name : {"R", "G", "B"}) {
        header.channels().insert(name, Imf::Channel(Imf::FLOAT));
        frame.insert(name, Imf::Slice::Make(Imf::FLOAT, reinterpret_cast<const char*>(rgba.data()) + 4 * c++, window,
                                            sizeof(glm::vec4), sizeof(glm::vec4) * static_cast<size_t>(width)));
    }
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(height);
}

std::string contentOf(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(SceneSkyImage, Radiance) {
    const TemporaryFolder folder;
    // 1 = 128 * 2^-7; the exponents tell the texels apart.
    const std::string file = radianceFile(2, 1, {{128, 64, 0, 129}, {128, 128, 128, 139}});
    const auto image = readSkyImage(folder.write("sky.hdr", file.data(), file.size()));
    ASSERT_TRUE(image.has_value()) << image.error().message;
    ASSERT_EQ(image->width, 2u);
    EXPECT_EQ(glm::vec3(image->texels[0]), glm::vec3(1, 0.5f, 0));
    EXPECT_EQ(glm::vec3(image->texels[1]), glm::vec3(1024));

    const std::string runs = radianceRuns(100, 3);
    const auto even = readSkyImage(folder.write("sky.hdr", runs.data(), runs.size()));
    ASSERT_TRUE(even.has_value()) << even.error().message;
    for (const glm::vec4& t : even->texels) EXPECT_EQ(glm::vec3(t), glm::vec3(2, 0.5f, 0.25f));
}

TEST(SceneSkyImage, OpenExrWithAWindowOfItsOwn) {
    const TemporaryFolder folder;
    std::vector<glm::vec4> texels;
    for (int i = 0; i < 12; ++i) texels.emplace_back(i, 100 * i, i == 5 ? -0.25f : 1e6f, 0);
    for (const int at : {0, -7, 20}) {
        writeOpenExr(folder.path / "sky.exr", 4, 3, texels, at, 2 * at);
        const auto image = readSkyImage(folder.path / "sky.exr");
        ASSERT_TRUE(image.has_value()) << image.error().message;
        ASSERT_EQ(image->width, 4u);
        ASSERT_EQ(image->height, 3u);
        for (size_t i = 0; i < 12; ++i)  // what is negative counts as black
            EXPECT_EQ(glm::vec3(image->texels[i]), glm::max(glm::vec3(texels[i]), glm::vec3(0)));
    }
}

// Cropped to its content, or with more than is shown: texels lie where the display has them.
TEST(SceneSkyImage, OpenExrWithAnotherDisplayWindow) {
    const TemporaryFolder folder;
    std::vector<glm::vec4> texels;
    for (int i = 0; i < 12; ++i) texels.emplace_back(1 + i, 0, 0, 0);
    const auto redOf = [&](const Imath::Box2i& display) {
        writeOpenExr(folder.path / "sky.exr", 4, 3, texels, 10, 20, display);
        const auto image = readSkyImage(folder.path / "sky.exr");
        EXPECT_TRUE(image.has_value()) << image.error().message;
        std::vector<float> red;
        if (image)
            for (const glm::vec4& t : image->texels) red.push_back(t.x);
        return red;
    };
    EXPECT_EQ(redOf({{9, 20}, {14, 23}}),  // one more column to the left and to the right, one more row below
              (std::vector<float>{0, 1, 2, 3, 4, 0, 0, 5, 6, 7, 8, 0, 0, 9, 10, 11, 12, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(redOf({{11, 21}, {12, 22}}), (std::vector<float>{6, 7, 10, 11}));
    EXPECT_EQ(redOf({{13, 22}, {14, 23}}), (std::vector<float>{12, 0, 0, 0}));
    EXPECT_EQ(redOf({{30, 20}, {31, 20}}), (std::vector<float>{0, 0}));
    EXPECT_EQ(redOf({{10, 30}, {10, 31}}), (std::vector<float>{0, 0}));
}

// Luminance is the same in all primaries: of AP0 (SMPTE ST 2065-1) it is 0.34397 R + 0.72817 G - 0.07213 B.
TEST(SceneSkyImage, OpenExrOfOtherPrimariesIsConverted) {
    const TemporaryFolder folder;
    const std::vector<glm::vec4> texels = {{1, 1, 1, 0}, {0.4f, 0.5f, 0.45f, 0}};
    const Imf::Chromaticities ap0({0.7347f, 0.2653f}, {0, 1}, {0.0001f, -0.077f}, {0.32168f, 0.33767f});
    writeOpenExr(folder.path / "sky.exr", 2, 1, texels, 0, 0, {}, ap0);
    const auto image = readSkyImage(folder.path / "sky.exr");
    ASSERT_TRUE(image.has_value()) << image.error().message;
    const double wanted[] = {1, 0.34397 * 0.4 + 0.72817 * 0.5 - 0.07213 * 0.45};
    for (size_t i = 0; i < 2; ++i) {
        const glm::vec4 t = image->texels[i];
        EXPECT_NEAR(0.2126f * t.x + 0.7152f * t.y + 0.0722f * t.z, wanted[i], 2e-4) << i;
    }
    EXPECT_GT(image->texels[0].x, image->texels[0].z);  // its white is of 6,000 K, a little warmer
    writeOpenExr(folder.path / "sky.exr", 2, 1, texels, 0, 0, {}, Imf::Chromaticities());
    EXPECT_EQ(glm::vec3(readSkyImage(folder.path / "sky.exr")->texels[1]), glm::vec3(0.4f, 0.5f, 0.45f));
}

TEST(SceneSkyImage, InALevel) {
    const TemporaryFolder folder;
    const std::string file = radianceFile(2, 1, {{128, 64, 0, 129}, {128, 128, 128, 139}});
    folder.write("sky.hdr", file.data(), file.size());
    const auto import = [&](const json& extras) {
        LevelFile level = LevelFile::withFloor();
        level.document["scenes"][0]["extras"] = extras;
        const std::string text = level.gltfText();
        return importLevel(folder.write("level.gltf", text.data(), text.size()));
    };
    auto scene = import({{"dimmer_sky_image", "sky.hdr"}});
    ASSERT_IMPORTED(scene);
    ASSERT_TRUE(scene->sky_image);
    EXPECT_EQ(scene->sky_radiance_cd_m2, glm::vec3(1));
    EXPECT_TRUE(scene->warnings.empty());
    EXPECT_EQ(glm::vec3(scene->sky_image->texels[1]), glm::vec3(1024));

    scene = import({{"dimmer_sky_image", "sky.hdr"}, {"dimmer_sky_luminance", 4}});
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->sky_radiance_cd_m2, glm::vec3(4));
    scene = import({{"dimmer_sky_image", "sky.hdr"}, {"dimmer_sky_luminance", 4}, {"dimmer_sky_color", {1, 0.5, 0}}});
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->sky_radiance_cd_m2, glm::vec3(4, 2, 0));

    expectBadInput(import({{"dimmer_sky_image", "sky.hdr"}, {"dimmer_sky_luminance", -1}}), {"scene", "negative"});
    expectBadInput(import({{"dimmer_sky_image", "sky.hdr"}, {"dimmer_sky_luminance", 1e37}}), {"scene", "infinite"});
    expectBadInput(import({{"dimmer_sky_image", 5}}), {"scene", "dimmer_sky_image"});
    expectBadInput(import({{"dimmer_sky_image", "none.hdr"}}), {"scene", "none.hdr"});
}

TEST(SceneSkyImage, BadFilesAreRefused) {
    const TemporaryFolder folder;
    const auto refused = [&](const std::string& content, const char* message) {
        const auto image = readSkyImage(folder.write("sky.hdr", content.data(), content.size()));
        ASSERT_FALSE(image.has_value()) << message;
        EXPECT_EQ(image.error().code, ErrorCode::BadInput);
        EXPECT_THAT(image.error().message, testing::HasSubstr(message));
        EXPECT_THAT(image.error().message, testing::HasSubstr("sky.hdr"));
    };
    refused("", "neither");
    refused("\x89PNG", "neither");
    refused("#?RADIANCE\n", "damaged");
    refused(radianceFile(100000, 100000, {}), "100000 x 100000");
    refused(radianceFile(20, 20, {}), "damaged");  // its texels are missing
    refused("\x76\x2f\x31\x01", "damaged");
    std::vector<glm::vec4> texels(12, glm::vec4(1));
    texels[7].y = std::numeric_limits<float>::quiet_NaN();
    writeOpenExr(folder.path / "nan.exr", 4, 3, texels);
    refused(contentOf(folder.path / "nan.exr"), "NaN");
}

TEST(SceneSkyImage, DamagedFilesNeverCrash) {
    const TemporaryFolder folder;
    std::vector<glm::vec4> texels(32 * 16);
    for (size_t i = 0; i < texels.size(); ++i) texels[i] = glm::vec4(static_cast<float>(i));
    writeOpenExr(folder.path / "good.exr", 32, 16, texels);
    std::mt19937 random(5);
    for (const std::string& good : {contentOf(folder.path / "good.exr"), radianceRuns(100, 8)}) {
        int refused = 0;
        for (int i = 0; i < 300; ++i) {
            std::string file = good;
            for (uint32_t edits = random() % 4; edits > 0; --edits)
                file[4 + random() % (file.size() - 4)] = static_cast<char>(random());
            if (random() % 2) file.resize(4 + random() % (file.size() - 4));
            const auto image = readSkyImage(folder.write("sky.img", file.data(), file.size()));
            if (!image) {
                ++refused;
                EXPECT_THAT(image.error().message, testing::HasSubstr("sky.img"));
            } else {
                EXPECT_EQ(image->texels.size(), size_t{image->width} * image->height);
            }
        }
        EXPECT_GT(refused, 100);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
