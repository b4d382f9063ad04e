// Whose file is replaced decides who may read it, and whether it is replaced at all.
#include <app/process.h>
#include <gmock/gmock.h>
#include <scene/level_file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <write/pack_writer.h>

#include <string>

namespace dimmer::cook::test {
namespace {

using dimmer::test::readText;

class RightsOfAFile : public testing::Test {
   protected:
    const TemporaryFolder folder_;
    const std::filesystem::path path_ = folder_.write("a.dimmer", "old", 3);

    static Expected<void> replace(const std::filesystem::path& path) {
        const std::string text = "new";
        return writeFileAtomically(path, std::as_bytes(std::span(text)));
    }
    mode_t mode() const {
        struct stat status {};
        EXPECT_EQ(stat(path_.c_str(), &status), 0);
        return status.st_mode & 07777;
    }
    size_t filesThere() const {
        return static_cast<size_t>(std::distance(std::filesystem::directory_iterator(folder_.path), {}));
    }
};

TEST_F(RightsOfAFile, StayThoseOfTheOneThatWasReplaced) {
    for (const mode_t before : {0600u, 0644u, 0666u, 0755u, 0200u}) {
        ASSERT_EQ(chmod(path_.c_str(), before), 0);
        ASSERT_TRUE(replace(path_)) << before;
        EXPECT_EQ(mode(), before);
    }
    ASSERT_EQ(chmod(path_.c_str(), 0600), 0);
    EXPECT_EQ(readText(path_), "new");
}

TEST_F(RightsOfAFile, BelongToWhomTheyBelonged) {
    if (geteuid() != 0) GTEST_SKIP() << "only root may give files away";
    ASSERT_EQ(chown(path_.c_str(), 12345, 54321), 0);
    ASSERT_EQ(chmod(path_.c_str(), 0640), 0);
    ASSERT_TRUE(replace(path_));
    struct stat status {};
    ASSERT_EQ(stat(path_.c_str(), &status), 0);
    EXPECT_EQ(status.st_uid, 12345u);
    EXPECT_EQ(status.st_gid, 54321u);
    EXPECT_EQ(mode(), 0640u);
}

// Even for root, who may write anything.
TEST_F(RightsOfAFile, ThatMayOnlyBeReadKeepItAsItIs) {
    std::filesystem::create_symlink("a.dimmer", folder_.path / "link");
    for (const mode_t before : {0444u, 0400u, 0555u}) {
        ASSERT_EQ(chmod(path_.c_str(), before), 0);
        for (const auto& path : {path_, folder_.path / "link"})
            for (const auto& refused : {checkWritable(path), replace(path)}) {
                ASSERT_FALSE(refused.has_value()) << before;
                EXPECT_EQ(refused.error().code, ErrorCode::Io);
                EXPECT_EQ(refused.error().message, path_.string() + ": is read-only");
            }
        EXPECT_EQ(mode(), before);
        EXPECT_EQ(readText(path_), "old");
    }
    EXPECT_EQ(filesThere(), 2u);  // no temporary
}

}  // namespace
}  // namespace dimmer::cook::test
