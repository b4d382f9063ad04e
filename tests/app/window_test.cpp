// The sample's window, on SDL's display that nobody sees.
#include <app/tool_fixture.h>
#include <pack/sample_pack.h>
#include <write/pack_writer.h>

#include <gtest/gtest.h>
#include <stb_image.h>

#include <cstdlib>

namespace dimmer::test {
namespace {

using testing::HasSubstr;

struct Image {
    int width = 0, height = 0;
    std::vector<uint8_t> rgb;
    const uint8_t* at(int x, int y) const {
        return &rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x))];
    }
};

Image readImage(const std::string& path) {
    Image image;
    int channels = 0;
    uint8_t* const pixels = stbi_load(path.c_str(), &image.width, &image.height, &channels, 3);
    if (!pixels) return image;
    image.rgb.assign(pixels, pixels + 3 * static_cast<ptrdiff_t>(image.width) * image.height);
    stbi_image_free(pixels);
    return image;
}

class SampleWindowGpu : public ToolTest {
   protected:
    static ProcessResult run(std::vector<std::string> arguments, const std::vector<std::string>& display) {
        std::vector<std::string> all = display;
        all.push_back(DIMMER_SAMPLE_TOOL);
        all.insert(all.end(), arguments.begin(), arguments.end());
        return runProcess("/usr/bin/env", all);
    }
    static ProcessResult runUnseen(const std::vector<std::string>& arguments) {
        return run(arguments, {"SDL_VIDEODRIVER=dummy"});
    }
};

TEST_F(SampleWindowGpu, ShowsTheLevelAndThePanelsAboveIt) {
    const auto shown = runUnseen({pack(), "--size", "960x200", "--frames", "3", "--picture", file("window.png")});
    ASSERT_EQ(shown.exit_code, 0) << shown.err;
    const auto played = runProcess(
        DIMMER_SAMPLE_TOOL, {pack(), "--size", "960x200", "--frames", "3", "--headless", "--out", file("frames")});
    ASSERT_EQ(played.exit_code, 0) << played.err;
    const Image window = readImage(file("window.png")), frame = readImage(file("frames/frame_0002.png"));
    ASSERT_EQ(window.width, 960);
    ASSERT_EQ(window.height, 200);
    ASSERT_EQ(frame.rgb.size(), window.rgb.size());
    // Between the panels, which are 280 and 270 wide, the level as a player without a window sees it.
    size_t beside = 0, under = 0;
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 960; ++x) {
            const bool same = std::equal(window.at(x, y), window.at(x, y) + 3, frame.at(x, y));
            if (x >= 300 && x < 670) beside += !same;
            if (x >= 20 && x < 280 && y >= 20 && y < 100) under += !same;
        }
    EXPECT_EQ(beside, 0u);
    EXPECT_GT(under, 260u * 80 / 2) << "the panel of light sets covers this";
}

TEST_F(SampleWindowGpu, PlaysAScriptUnderTheValidationLayers) {
    const std::string script =
        write("dark.script", "size 640 200\nfps 2\nat 1 set all=0\nat 2 camera 1 1 1 look 0 1 0\n");
    const auto shown = runUnseen({pack(), "--script", script, "--frames", "8", "--validate"});
    if (shown.err.find("VK_LAYER_KHRONOS_validation is not installed") != std::string::npos)
        GTEST_SKIP() << "the Vulkan validation layer is not installed";
    EXPECT_EQ(shown.exit_code, 0) << shown.err;
}

// Names that Dear ImGui takes for ids, or for none, and a maximum beyond what its sliders take.
TEST_F(SampleWindowGpu, TakesOddNamesAndMaxima) {
    PackData data = samplePack();
    data.elements[0].name = "100% a ## b";
    data.elements[0].max_weight = max_weight_limit;
    data.elements[1].name = "%s%n";
    data.elements[1].max_weight = 1e-30f;
    data.viewpoints[0].name = "";
    data.viewpoints[1].name = "View";
    ASSERT_TRUE(cook::writeFileAtomically(file("odd.dimmer"), cook::packBytes(data)));
    const auto shown = runUnseen({file("odd.dimmer"), "--frames", "3"});
    EXPECT_EQ(shown.exit_code, 0) << shown.err;
}

TEST_F(SampleWindowGpu, WithoutADisplaySaysWhatElseThereIs) {
    const auto refused = run({pack(), "--frames", "1"}, {"-u", "DISPLAY", "SDL_VIDEODRIVER=x11"});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("--headless"));
    if (std::filesystem::exists("/dev/dri")) GTEST_SKIP() << "SDL might draw on this machine's own screen";
    // SDL by itself would draw where nobody sees it.
    const auto unseen =
        run({pack(), "--frames", "1"}, {"-u", "DISPLAY", "-u", "WAYLAND_DISPLAY", "-u", "SDL_VIDEODRIVER"});
    EXPECT_EQ(unseen.exit_code, 2);
    EXPECT_THAT(unseen.err, HasSubstr("--headless"));
}

TEST_F(SampleWindowGpu, RefusesAPictureOfNothing) {
    for (const auto& arguments : {std::vector<std::string>{pack(), "--picture", file("p.png")},
                                  {pack(), "--headless", "--frames", "1", "--picture", file("p.png")}}) {
        const auto refused = runUnseen(arguments);
        EXPECT_EQ(refused.exit_code, 2);
        EXPECT_THAT(refused.err, HasSubstr("--frames"));
    }
    const auto nowhere = runUnseen({pack(), "--frames", "1", "--picture", file("no/such/p.png")});
    EXPECT_EQ(nowhere.exit_code, 2);
    EXPECT_THAT(nowhere.err, HasSubstr("no/such/p.png"));
}

}  // namespace
}  // namespace dimmer::test
