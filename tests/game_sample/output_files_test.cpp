// What a run writes: not over its inputs, and not beside an earlier run's.
#include <game_sample/output_files.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fmt/format.h>
#include <fstream>
#include <iterator>

namespace dimmer::sample {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SampleOutputs : public testing::Test {
   protected:
    SampleOutputs() { fs::create_directory(folder_); }
    ~SampleOutputs() override { fs::remove_all(folder_); }

    fs::path file(const char* name, std::string_view text = "x") const {
        std::ofstream(folder_ / name) << text;
        return folder_ / name;
    }
    static std::string read(const fs::path& path) {
        std::ifstream in(path);
        return {std::istreambuf_iterator<char>(in), {}};
    }

    const fs::path folder_ = fs::temp_directory_path() / fmt::format("dimmer_sample_outputs_{}", getpid());
};

TEST_F(SampleOutputs, FramesOfAnEarlierRunGo) {
    const fs::path old[] = {file("frame_0003.png"), file("frame_12345.png"), file("cost.json")};
    const fs::path others[] = {file("frame_a.png"), file("frame_.png"), file("frame_1.png.txt"), file("house.dimmer")};
    ASSERT_TRUE(prepareFolder(folder_, {others[3], ""}));
    for (const fs::path& path : old) EXPECT_FALSE(fs::exists(path)) << path;
    for (const fs::path& path : others) EXPECT_TRUE(fs::exists(path)) << path;
    EXPECT_TRUE(prepareFolder(folder_ / "new" / "deep", {}));
    EXPECT_TRUE(fs::is_directory(folder_ / "new" / "deep"));
}

TEST_F(SampleOutputs, InputsStay) {
    const fs::path frame = file("frame_0000.png"), pack = file("cost.json"), script = file("frame_0001.png");
    for (const fs::path& input : {pack, script}) {
        const auto ready = prepareFolder(folder_, {input});
        ASSERT_FALSE(ready);
        EXPECT_THAT(ready.error().message, HasSubstr(input.filename().string()));
        EXPECT_TRUE(fs::exists(frame));
        EXPECT_TRUE(fs::exists(input));
        EXPECT_FALSE(checkPicture(folder_ / "." / input.filename(), {input}));
    }
    fs::create_symlink(pack, folder_ / "link.png");
    EXPECT_FALSE(checkPicture(folder_ / "link.png", {pack}));
    EXPECT_TRUE(checkPicture(folder_ / "shown.png", {pack, script, ""}));
    EXPECT_TRUE(checkPicture("", {pack}));
    EXPECT_FALSE(checkPicture(folder_, {pack}));
    EXPECT_FALSE(checkPicture("/dev/null", {pack}));  // a device would be written over
    EXPECT_FALSE(checkPicture(folder_ / "none" / "shown.png", {pack}));
}

TEST_F(SampleOutputs, AreWholeOrNotThere) {
    EXPECT_TRUE(writeFile(folder_ / "cost.json", "{}"));
    EXPECT_EQ(read(folder_ / "cost.json"), "{}");
    fs::create_directories(folder_ / "taken" / "by a folder");
    EXPECT_FALSE(writeFile(folder_ / "taken", "{}"));
    EXPECT_FALSE(fs::exists(folder_ / "taken.part"));
}

}  // namespace
}  // namespace dimmer::sample
