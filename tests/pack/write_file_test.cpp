// A pack on disk is as it was or complete, whatever happens while it is written.
#include <app/process.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <scene/level_file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <write/pack_writer.h>

#include <csignal>
#include <fstream>

namespace {

int flushed_files = 0, flushed_folders = 0;

}  // namespace

// In the place of the C library's: counts, and flushes.
extern "C" int fsync(int file) {
    struct stat status {};
    if (fstat(file, &status) == 0) ++(S_ISDIR(status.st_mode) ? flushed_folders : flushed_files);
    return static_cast<int>(syscall(SYS_fsync, file));
}

namespace dimmer::cook::test {
namespace {

using dimmer::test::readText;
using testing::HasSubstr;

Expected<void> write(const std::filesystem::path& path, const std::string& text) {
    return writeFileAtomically(path, std::as_bytes(std::span(text)));
}

size_t filesIn(const std::filesystem::path& folder) {
    return static_cast<size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

void expectIoError(const Expected<void>& done, const std::filesystem::path& path, const char* reason) {
    ASSERT_FALSE(done.has_value()) << path;
    EXPECT_EQ(done.error().code, ErrorCode::Io) << path;
    EXPECT_THAT(done.error().message, HasSubstr(path.string()));
    EXPECT_THAT(done.error().message, HasSubstr(reason));
}

// No file may grow past `bytes` while this lives: a full disk without filling one.
class FileSizeLimit {
   public:
    explicit FileSizeLimit(rlim_t bytes) {
        getrlimit(RLIMIT_FSIZE, &before_);
        handler_ = std::signal(SIGXFSZ, SIG_IGN);  // so that write() fails instead
        const rlimit limit{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;

   private:
    rlimit before_{};
    void (*handler_)(int) = nullptr;
};

TEST(WriteFile, MakesAndReplaces) {
    const TemporaryFolder folder;
    const auto path = folder.path / "a.dimmer";
    ASSERT_TRUE(write(path, "one"));
    EXPECT_EQ(readText(path), "one");
    ASSERT_TRUE(write(path, "the second"));
    EXPECT_EQ(readText(path), "the second");
    ASSERT_TRUE(write(path, ""));
    EXPECT_EQ(readText(path), "");
    EXPECT_EQ(filesIn(folder.path), 1u);
    // Readable as any file that the user makes.
    struct stat status {};
    stat(path.c_str(), &status);
    const mode_t mask = umask(0);
    umask(mask);
    EXPECT_EQ(status.st_mode & 0777, 0666 & ~mask);
}

// After a power cut the folder has the new file's name: it is flushed too, once it has it.
TEST(WriteFile, FlushesTheFileAndItsFolder) {
    const TemporaryFolder folder;
    flushed_files = flushed_folders = 0;
    ASSERT_TRUE(write(folder.path / "a.dimmer", "one"));
    EXPECT_EQ(flushed_files, 1);
    EXPECT_EQ(flushed_folders, 1);
    const std::string text = "two";
    ASSERT_TRUE(writeFileAtomically(folder.path / "b.entry", std::as_bytes(std::span(text)), Flush::No));
    EXPECT_EQ(flushed_files, 1);
    EXPECT_EQ(flushed_folders, 1);
}

TEST(WriteFile, AFullDiskLeavesTheOldFile) {
    const TemporaryFolder folder;
    const auto path = folder.path / "a.dimmer";
    ASSERT_TRUE(write(path, "old"));
    {
        const FileSizeLimit full(1 << 16);
        expectIoError(write(path, std::string(1 << 20, 'x')), path, "nothing was changed");
        expectIoError(write(folder.path / "b.dimmer", std::string(1 << 20, 'x')), folder.path / "b.dimmer", "large");
    }
    EXPECT_EQ(readText(path), "old");
    EXPECT_EQ(filesIn(folder.path), 1u);  // no temporary, no b.dimmer
}

TEST(WriteFile, FoldersThatCannotBeWritten) {
    const TemporaryFolder folder;
    expectIoError(write(folder.path / "none/a.dimmer", "x"), folder.path / "none/a.dimmer", "there is no folder");
    folder.write("file", "x", 1);
    expectIoError(write(folder.path / "file/a.dimmer", "x"), folder.path / "file/a.dimmer", "there is no folder");
    expectIoError(write("/proc/a.dimmer", "x"), "/proc/a.dimmer", "in this folder");  // even for root
    EXPECT_FALSE(write("", "x").has_value());
}

TEST(WriteFile, AFolderWithoutRightsLeavesTheOldFile) {
    if (geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
    const TemporaryFolder folder;
    const auto path = folder.path / "a.dimmer";
    ASSERT_TRUE(write(path, "old"));
    std::filesystem::permissions(folder.path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
    expectIoError(write(path, "new"), path, "in this folder");
    expectIoError(write(folder.path / "b.dimmer", "new"), folder.path / "b.dimmer", "in this folder");
    std::filesystem::permissions(folder.path, std::filesystem::perms::owner_all);
    EXPECT_EQ(readText(path), "old");
    EXPECT_EQ(filesIn(folder.path), 1u);
}

TEST(WriteFile, AFolderIsNotReplaced) {
    const TemporaryFolder folder;
    expectIoError(write(folder.path, "x"), folder.path, "directory");
    const auto full = folder.path / "full";
    std::filesystem::create_directory(full);
    std::ofstream(full / "inside") << "kept";
    expectIoError(write(full, "x"), full, "directory");
    EXPECT_EQ(readText(full / "inside"), "kept");
    EXPECT_EQ(filesIn(folder.path), 1u);
}

TEST(WriteFile, DevicesAreWrittenToAndNeverReplaced) {
    ASSERT_TRUE(write("/dev/null", "x"));
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
    expectIoError(write("/dev/full", "x"), "/dev/full", "No space left");
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST(WriteFile, LinksAreFollowed) {
    const TemporaryFolder folder;
    const auto target = folder.path / "target", link = folder.path / "link";
    ASSERT_TRUE(write(target, "old"));
    std::filesystem::create_symlink("target", link);
    ASSERT_TRUE(write(link, "new"));
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_EQ(readText(target), "new");
    EXPECT_EQ(filesIn(folder.path), 2u);
}

TEST(WriteFile, LinksToWhatIsNotThereYetAreFollowed) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder.path / "deep");
    const auto first = folder.path / "first", second = folder.path / "deep/second";
    std::filesystem::create_symlink("deep/second", first);
    std::filesystem::create_symlink("../target", second);  // from where the link is
    EXPECT_TRUE(checkWritable(first));
    ASSERT_TRUE(write(first, "new"));
    EXPECT_TRUE(std::filesystem::is_symlink(first));
    EXPECT_TRUE(std::filesystem::is_symlink(second));
    EXPECT_FALSE(std::filesystem::is_symlink(folder.path / "target"));
    EXPECT_EQ(readText(folder.path / "target"), "new");
    std::filesystem::create_symlink(folder.path / "absolute", folder.path / "link");
    ASSERT_TRUE(write(folder.path / "link", "x"));
    EXPECT_EQ(readText(folder.path / "absolute"), "x");
}

TEST(WriteFile, LinksThatLeadNowhereStay) {
    const TemporaryFolder folder;
    const auto lost = folder.path / "lost", loop = folder.path / "loop";
    std::filesystem::create_symlink("none/target", lost);
    std::filesystem::create_symlink("loop", loop);
    expectIoError(checkWritable(lost), folder.path / "none", "there is no folder");
    expectIoError(checkWritable(loop), loop, "Too many levels");
    EXPECT_FALSE(write(lost, "x"));
    EXPECT_FALSE(write(loop, "x"));
    EXPECT_TRUE(std::filesystem::is_symlink(lost));
    EXPECT_TRUE(std::filesystem::is_symlink(loop));
    EXPECT_EQ(filesIn(folder.path), 2u);
}

TEST(WriteFile, NamesWithoutRoomForATemporaryAreKnownBefore) {
    const TemporaryFolder folder;
    // NAME_MAX is 255 on Linux's file systems; the temporary's name is 7 longer.
    const auto longest = folder.path / std::string(248, 'n');
    EXPECT_TRUE(checkWritable(longest));
    EXPECT_TRUE(write(longest, "x"));
    for (const size_t length : {249, 255, 256, 5000}) {
        const auto path = folder.path / std::string(length, 'n');
        expectIoError(checkWritable(path), path, "File name too long");
    }
    EXPECT_EQ(filesIn(folder.path), 1u);
}

// In a process of its own, which gives root's rights away: exit code 0 when the reason is that of rights.
void expectNoRights(const std::filesystem::path& path) {
    const auto asNobody = [&] {
        if (geteuid() == 0 && (setgid(65534) != 0 || setuid(65534) != 0)) _exit(3);
        const auto done = checkWritable(path);
        if (done) _exit(1);
        _exit(done.error().message.find("Permission denied") != std::string::npos ? 0 : 2);
    };
    EXPECT_EXIT(asNobody(), testing::ExitedWithCode(0), "") << path;
}

TEST(WriteFile, WhatRightsForbidIsKnownBeforeAndNamed) {
    const TemporaryFolder folder;
    ASSERT_TRUE(write(folder.path / "old", "x"));
    using std::filesystem::perms;
    std::filesystem::permissions(folder.path, perms::owner_read | perms::owner_exec | perms::others_read |
                                                  perms::others_exec | perms::group_read | perms::group_exec);
    expectNoRights(folder.path / "new");
    expectNoRights(folder.path / "old");  // replaced by a new file beside it, not overwritten
    std::filesystem::permissions(folder.path, perms::none);
    expectNoRights(folder.path / "old");
    expectNoRights(folder.path / "inner/new");
    std::filesystem::permissions(folder.path, perms::owner_all);
}

}  // namespace
}  // namespace dimmer::cook::test
