// Entries come back as they were kept, or not at all.
#include <cache/store.h>
#include <gmock/gmock.h>
#include <pipeline/small_level.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <future>
#include <thread>

namespace dimmer::cook::test {
namespace {

std::vector<std::byte> bytesOf(const std::string& text) {
    const auto raw = std::as_bytes(std::span(text));
    return {raw.begin(), raw.end()};
}

Key keyOf(uint32_t n) {
    return KeyBuilder("test").add(n).finish();
}

std::filesystem::path onlyEntry(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& f : std::filesystem::directory_iterator(folder)) files.push_back(f.path());
    EXPECT_EQ(files.size(), 1u);
    return files.empty() ? std::filesystem::path() : files.front();
}

TEST(CacheStore, FindsWhatItKept) {
    const TemporaryFolder folder;
    const auto store = CacheStore::open(folder.path / "deep/cache");
    ASSERT_TRUE(store) << store.error().message;
    EXPECT_EQ(store->find("light", keyOf(1)).find, Find::Missing);
    for (const std::string& text : {std::string(), std::string("x"), std::string(100000, 'a')}) {
        ASSERT_TRUE(store->keep("light", keyOf(1), bytesOf(text)));
        const Entry entry = store->find("light", keyOf(1));
        EXPECT_EQ(entry.find, Find::Hit);
        EXPECT_EQ(entry.bytes, bytesOf(text));
    }
    EXPECT_EQ(store->find("light", keyOf(2)).find, Find::Missing);
    EXPECT_EQ(store->find("charts", keyOf(1)).find, Find::Missing);
}

TEST(CacheStore, AnyDamageIsSeen) {
    const TemporaryFolder folder;
    const auto store = CacheStore::open(folder.path);
    ASSERT_TRUE(store);
    ASSERT_TRUE(store->keep("light", keyOf(1), bytesOf("what a stage found out")));
    const auto file = onlyEntry(folder.path);
    std::ifstream in(file, std::ios::binary);
    const std::string whole(std::istreambuf_iterator<char>(in), {});
    const auto rewrite = [&](const std::string& bytes) {
        std::ofstream(file, std::ios::binary) << bytes;
        return store->find("light", keyOf(1)).find;
    };
    for (size_t i = 0; i < whole.size(); ++i) {
        std::string flipped = whole;
        flipped[i] = static_cast<char>(flipped[i] ^ 1);
        EXPECT_EQ(rewrite(flipped), Find::Damaged) << "byte " << i;
        EXPECT_EQ(rewrite(whole.substr(0, i)), Find::Damaged) << "cut at " << i;
    }
    EXPECT_EQ(rewrite(whole + "x"), Find::Damaged);
    EXPECT_EQ(rewrite(whole), Find::Hit);
}

TEST(CacheStore, AnEntryUnderAnothersNameIsNone) {
    const TemporaryFolder folder;
    const auto store = CacheStore::open(folder.path);
    ASSERT_TRUE(store);
    for (uint32_t i = 0; i < 2; ++i) ASSERT_TRUE(store->keep("light", keyOf(i), bytesOf("light of one")));
    const auto file = [&](uint32_t i) { return folder.path / CacheStore::nameOf("light", keyOf(i)); };
    std::filesystem::rename(file(0), file(1));
    EXPECT_EQ(store->find("light", keyOf(1)).find, Find::Damaged);
    ASSERT_TRUE(store->keep("light", keyOf(1), bytesOf("light of one")));
    EXPECT_EQ(store->find("light", keyOf(1)).find, Find::Hit);
    std::filesystem::create_directory(file(0));
    EXPECT_EQ(store->find("light", keyOf(0)).find, Find::Missing);
}

// Opened, a pipe keeps one waiting for its other end. Here that comes after a while, lest the test wait as well.
TEST(CacheStore, APipeIsNoEntryAndNoPlaceForOne) {
    const TemporaryFolder folder;
    const auto store = CacheStore::open(folder.path);
    ASSERT_TRUE(store);
    const auto pipe = folder.path / CacheStore::nameOf("light", keyOf(1));
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const auto endsByItself = [&](auto&& work, int other_end) {
        auto done = std::async(std::launch::async, work);
        const bool in_time = done.wait_for(std::chrono::seconds(10)) == std::future_status::ready;
        if (in_time) return true;
        const int end = open(pipe.c_str(), other_end | O_NONBLOCK);
        done.wait();
        close(end);
        return false;
    };
    Find found = Find::Hit;
    EXPECT_TRUE(endsByItself([&] { found = store->find("light", keyOf(1)).find; }, O_WRONLY));
    EXPECT_EQ(found, Find::Missing);
    Expected<void> kept;
    EXPECT_TRUE(endsByItself([&] { kept = store->keep("light", keyOf(1), bytesOf("light of one")); }, O_RDONLY));
    ASSERT_FALSE(kept);
    EXPECT_THAT(kept.error().message, testing::HasSubstr(pipe.string()));
    EXPECT_TRUE(std::filesystem::is_fifo(pipe));
    EXPECT_THAT(store->trim(0), testing::IsEmpty());
}

// A pack that lists what is not an entry of the folder touches nothing.
TEST(CacheStore, MarksNothingButEntries) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder.path / "cache");
    const auto store = CacheStore::open(folder.path / "cache");
    ASSERT_TRUE(store);
    const auto outside = writeText(folder, CacheStore::nameOf("light", keyOf(1)).c_str(), "not ours"),
               inside = writeText(folder, "cache/notes.txt", "mine");
    const auto before = std::filesystem::file_time_type::clock::now() - std::chrono::hours(48);
    for (const auto& file : {outside, inside}) std::filesystem::last_write_time(file, before);
    for (const std::string& name : {"../" + CacheStore::nameOf("light", keyOf(1)), std::string("notes.txt"),
                                    std::string(), CacheStore::nameOf("light", keyOf(2))})
        store->markUsed(name);
    for (const auto& file : {outside, inside}) EXPECT_EQ(std::filesystem::last_write_time(file), before);
}

TEST(CacheStore, TheLeastRecentlyUsedGoFirst) {
    const TemporaryFolder folder;
    const auto store = CacheStore::open(folder.path);
    ASSERT_TRUE(store);
    std::string noise;  // that zstd cannot make smaller
    for (uint32_t i = 0; i < 25000; ++i) noise += keyOf(i).hex()[0];
    const auto now = std::filesystem::file_time_type::clock::now();
    for (uint32_t i = 0; i < 4; ++i) {
        ASSERT_TRUE(store->keep("light", keyOf(i), bytesOf(noise)));
        for (const auto& f : std::filesystem::directory_iterator(folder.path))
            if (f.path().string().contains(keyOf(i).hex()))
                std::filesystem::last_write_time(f.path(), now - std::chrono::hours(4 - i));
    }
    uint64_t one = 0;
    for (const auto& f : std::filesystem::directory_iterator(folder.path)) one = std::max(one, f.file_size());
    EXPECT_THAT(store->trim(UINT64_MAX), testing::IsEmpty());
    EXPECT_EQ(store->find("light", keyOf(0)).find, Find::Hit);  // the oldest is used: it is the youngest now
    EXPECT_THAT(store->trim(4 * one), testing::IsEmpty());
    EXPECT_THAT(store->trim(2 * one),
                testing::ElementsAre(CacheStore::nameOf("light", keyOf(1)), CacheStore::nameOf("light", keyOf(2))));
    EXPECT_EQ(store->find("light", keyOf(0)).find, Find::Hit);
    EXPECT_EQ(store->find("light", keyOf(1)).find, Find::Missing);
    EXPECT_EQ(store->find("light", keyOf(2)).find, Find::Missing);
    EXPECT_EQ(store->find("light", keyOf(3)).find, Find::Hit);
    EXPECT_EQ(store->trim(0).size(), 2u);
}

// What a killed cook leaves goes after a day; what may belong to a running one, and what is not ours, stays, however it
// is called: a folder may be somebody's own.
TEST(CacheStore, AbandonedFilesGo) {
    const TemporaryFolder folder;
    const auto store = CacheStore::open(folder.path);
    ASSERT_TRUE(store);
    const std::string entry = CacheStore::nameOf("light", keyOf(1));
    const auto fresh = writeText(folder, entry + ".abcdef", "half"), old = writeText(folder, entry + ".x4Yz01", "half");
    const auto before = std::filesystem::file_time_type::clock::now() - std::chrono::hours(48);
    std::filesystem::last_write_time(old, before);
    std::vector<std::filesystem::path> others;
    for (const std::string& name :
         {std::string("notes.txt"), std::string("notes.entry.txt"), std::string("mine.entry"),
          std::string("my-1.entry"), entry + ".bak", entry + ".orig.x", "my " + entry, "-" + entry}) {
        others.push_back(writeText(folder, name, "mine"));
        std::filesystem::last_write_time(others.back(), before);
    }
    EXPECT_THAT(store->trim(0), testing::IsEmpty());
    EXPECT_TRUE(std::filesystem::exists(fresh));
    EXPECT_FALSE(std::filesystem::exists(old));
    for (const auto& other : others) EXPECT_TRUE(std::filesystem::exists(other)) << other;
}

TEST(CacheStore, AFolderThatCannotBeMade) {
    const TemporaryFolder folder;
    writeText(folder, "file", "no folder");
    const auto store = CacheStore::open(folder.path / "file");
    ASSERT_FALSE(store.has_value());
    EXPECT_THAT(store.error().message, testing::HasSubstr("file"));
}

TEST(CacheStore, ManyAtOnce) {
    const TemporaryFolder folder;
    const auto store = CacheStore::open(folder.path);
    ASSERT_TRUE(store);
    const auto content = [](uint32_t key) { return bytesOf(std::string(2000 + key, static_cast<char>('a' + key))); };
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (uint32_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (uint32_t i = 0; i < 200; ++i) {
                const uint32_t key = (i * 7 + t) % 5;
                const Entry entry = store->find("light", keyOf(key));
                // Whole or not there; a trim of another thread may have removed it.
                if (entry.find == Find::Damaged || (entry.find == Find::Hit && entry.bytes != content(key))) ++wrong;
                if (entry.find != Find::Hit && !store->keep("light", keyOf(key), content(key))) ++wrong;
                if (i % 50 == 49) store->trim(100);
            }
        });
    for (std::thread& t : threads) t.join();
    EXPECT_EQ(wrong, 0);
}

TEST(CacheKey, PartsDoNotRunTogether) {
    const auto key = [](const char* a, const char* b) {
        return KeyBuilder("test").add(std::string_view(a)).add(std::string_view(b)).finish();
    };
    EXPECT_EQ(key("ab", "c"), key("ab", "c"));
    EXPECT_NE(key("ab", "c"), key("a", "bc"));
    EXPECT_NE(KeyBuilder("a").finish(), KeyBuilder("b").finish());
    // Another code, another key.
    EXPECT_NE(KeyBuilder("a").finish(), KeyBuilder::ofAnyCode("a").finish());
    EXPECT_EQ(codeStamp().size(), 40u);
}

}  // namespace
}  // namespace dimmer::cook::test
