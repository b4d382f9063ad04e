// Packs are read a chunk at a time, and what stops the reading is no fault of the pack.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/pack_file.h>
#include <pack/pack_reader.h>
#include <pack/sample_pack.h>
#include <scene/level_file.h>
#include <write/pack_writer.h>

#include <algorithm>
#include <cstring>

namespace dimmer::test {
namespace {

using testing::HasSubstr;
using testing::Not;

// Reads from memory, and says how much it was asked for at once; fails from the given request on.
class WatchedSource : public PackSource {
   public:
    explicit WatchedSource(std::span<const std::byte> bytes, size_t fails_at = SIZE_MAX)
        : memory_(bytes), fails_at_(fails_at) {}
    uint64_t size() const override { return memory_.size(); }
    Expected<std::span<const std::byte>> read(uint64_t offset, uint64_t bytes) override {
        if (requests_++ >= fails_at_) return fail(ErrorCode::Io, "the disk is gone");
        most_ = std::max(most_, bytes);
        return memory_.read(offset, bytes);
    }
    uint64_t most() const { return most_; }
    size_t requests() const { return requests_; }

   private:
    MemorySource memory_;
    size_t fails_at_, requests_ = 0;
    uint64_t most_ = 0;
};

TEST(PackSource, AsksForAChunkAtATime) {
    const auto bytes = cook::packBytes(samplePack());
    std::vector<format::Chunk> table(PackFile(bytes).chunks.size());
    std::memcpy(table.data(), bytes.data() + sizeof(format::Header), table.size() * sizeof(format::Chunk));
    const uint64_t largest = std::ranges::max(table, {}, &format::Chunk::stored_bytes).stored_bytes;
    WatchedSource source(bytes);
    ASSERT_TRUE(readPack(source));
    EXPECT_EQ(source.most(), std::max(largest, table.size() * sizeof(format::Chunk)));
    EXPECT_EQ(source.requests(), 2 + table.size());  // the header and the table first
}

TEST(PackSource, WhatCannotBeReadIsNotSaidToBeDamaged) {
    const auto bytes = cook::packBytes(samplePack());
    for (const size_t fails_at : {0u, 1u, 2u, 5u}) {
        WatchedSource source(bytes, fails_at);
        const auto pack = readPack(source);
        ASSERT_FALSE(pack);
        EXPECT_EQ(pack.error().code, ErrorCode::Io);
        EXPECT_THAT(pack.error().message, Not(HasSubstr("cook the pack again")));
    }
}

TEST(PackSource, AFileThatShrinksIsAnError) {
    const cook::test::TemporaryFolder folder;
    const auto bytes = cook::packBytes(samplePack());
    const auto path = folder.write("shrinks.dimmer", bytes.data(), bytes.size());
    auto source = FileSource::open(path);
    ASSERT_TRUE(source) << source.error().message;
    ASSERT_TRUE(source->read(0, 64));
    EXPECT_TRUE(std::ranges::equal(*source->read(8, 32), std::span(bytes).subspan(8, 32)));
    std::filesystem::resize_file(path, bytes.size() / 2);
    const auto pack = readPack(*source);
    ASSERT_FALSE(pack);
    EXPECT_EQ(pack.error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace dimmer::test
