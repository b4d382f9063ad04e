// A cook that is killed at any moment, with nothing to say in the matter.
#include <app/tool_fixture.h>
#include <dimmer/pack.h>

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <csignal>
#include <random>

namespace dimmer::test {
namespace {

using Kill = ToolTest;

// SIGKILL at 50 moments, half of them spread over a whole cook, half over one that finds what those left in the cache:
// the old pack stays or the new one is whole, and a cook afterwards gives the bytes of an undisturbed one.
TEST_F(Kill, AtAnyMomentLeavesAWholePackAndAUsableCache) {
    using Clock = std::chrono::steady_clock;
    const std::string fresh = [&] {
        cook("fresh.dimmer", {"--no-cache"});
        return readText(file("fresh.dimmer"));
    }();
    std::array<Clock::duration, 2> lasts;  // without a cache, and with a full one
    for (auto& duration : lasts) {
        const auto begin = Clock::now();
        cook("timed.dimmer", {"--cache", file("timed_cache")});
        duration = Clock::now() - begin;
    }
    std::mt19937 random(7);
    // About half of the cooks end before their moment; at 400 something is wrong with the killing.
    int killed = 0;
    for (int i = 0; killed < 50 && i < 400; ++i) {
        const std::string old = i % 2 ? "the old pack" : fresh;
        write("kept.dimmer", old);
        const int use = i / 2 % 2;
        if (use == 0) std::filesystem::remove_all(file("kill_cache"));
        const auto moment = lasts[use] * (random() % 1000) / 1000;
        const auto started = Clock::now();
        const auto result =
            runInterrupted(DIMMER_TOOL,
                           {"cook", file("level.gltf"), "-o", file("kept.dimmer"), "--profile", file("quick.json"),
                            "--quality", "draft", "--cache", file("kill_cache")},
                           SIGKILL, [&](const std::string&) { return Clock::now() - started > moment; });
        killed += result.exit_code == 128 + SIGKILL;
        const std::string now = readText(file("kept.dimmer"));
        EXPECT_TRUE(now == old || now == fresh) << "at " << i;
        if (i % 10 != 9) continue;
        ASSERT_EQ(cook("after.dimmer", {"--cache", file("kill_cache")}).exit_code, 0);
        EXPECT_TRUE(readText(file("after.dimmer")) == fresh) << "after " << i;
    }
    EXPECT_EQ(killed, 50);
}

TEST_F(Kill, AFullDiskAndAReadOnlyFolderAreSaid) {
    write("kept.dimmer", "the old pack");
    // No file of this process and its children may grow past 2 kB: a disk as good as full.
    const std::string command = std::string("ulimit -f 4; '") + DIMMER_TOOL + "' cook '" + file("level.gltf") +
                                "' -o '" + file("kept.dimmer") + "' --profile '" + file("quick.json") +
                                "' --quality draft --cache '" + file("full_cache") + "'";
    const auto result = runProcess("/bin/sh", {"-c", command});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, testing::HasSubstr("kept.dimmer"));
    EXPECT_THAT(result.err, testing::HasSubstr("nothing was changed"));
    EXPECT_EQ(readText(file("kept.dimmer")), "the old pack");
    // Even root makes no files there.
    const auto nowhere = cook("level2.dimmer", {"--cache", "/proc/cache"});
    EXPECT_EQ(nowhere.exit_code, 0);
    EXPECT_THAT(nowhere.err, testing::HasSubstr("warning: cooked without a cache: /proc/cache"));
    const auto read_only = runDimmer({"cook", file("level.gltf"), "-o", "/proc/level.dimmer", "--profile",
                                      file("quick.json"), "--quality", "draft", "--no-cache"});
    EXPECT_EQ(read_only.exit_code, 2);
    EXPECT_THAT(read_only.err, testing::HasSubstr("/proc/level.dimmer"));
}

// A disk with room for the pack alone, whose cache would take that: in a name space of its own, where one may mount.
TEST_F(Kill, ACacheLeavesThePackItsRoom) {
    ASSERT_EQ(cook("alone.dimmer", {"--no-cache"}).exit_code, 0);
    const std::string disk = file("disk"), pack = disk + "/level.dimmer";
    std::filesystem::create_directory(disk);
    constexpr uintmax_t page = 4096;
    const auto pages = (std::filesystem::file_size(file("alone.dimmer")) + page - 1) / page + 1;
    const std::string mount = fmt::format("mount -t tmpfs -o size={} tmpfs '{}'", pages * page, disk);
    if (runProcess("/bin/sh", {"-c", "unshare -rm sh -c \"" + mount + "\""}).exit_code != 0)
        GTEST_SKIP() << "nothing may be mounted here";
    const auto result = runProcess(
        "/bin/sh",
        {"-c", fmt::format("unshare -rm sh -c \"{0} && '{1}' cook '{2}' -o '{3}' --profile '{4}' --quality draft; "
                           "code=\\$?; cp '{3}' '{5}'; exit \\$code\"",
                           mount, DIMMER_TOOL, file("level.gltf"), pack, file("quick.json"), file("copied.dimmer"))});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, testing::HasSubstr("there was room for the pack alone"));
    EXPECT_TRUE(readText(file("copied.dimmer")) == readText(file("alone.dimmer")));
}

}  // namespace
}  // namespace dimmer::test
