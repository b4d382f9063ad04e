// Where a pack's bytes come from, piece by piece: of a large file no more than a chunk stands in memory at a time.
#pragma once

#include <dimmer/error.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

namespace dimmer {

class PackSource {
   public:
    virtual ~PackSource() = default;
    virtual uint64_t size() const = 0;
    // Valid until the next call. What is asked for must lie within size(). Errors: Io.
    virtual Expected<std::span<const std::byte>> read(uint64_t offset, uint64_t bytes) = 0;
};

// `bytes` must outlive it.
class MemorySource : public PackSource {
   public:
    explicit MemorySource(std::span<const std::byte> bytes) : bytes_(bytes) {}
    uint64_t size() const override { return bytes_.size(); }
    Expected<std::span<const std::byte>> read(uint64_t offset, uint64_t bytes) override {
        return bytes_.subspan(offset, bytes);
    }

   private:
    std::span<const std::byte> bytes_;
};

class FileSource : public PackSource {
   public:
    // Errors: Io, without the file's name.
    static Expected<FileSource> open(const std::filesystem::path& path);
    uint64_t size() const override { return size_; }
    Expected<std::span<const std::byte>> read(uint64_t offset, uint64_t bytes) override;

   private:
    std::ifstream file_;
    uint64_t size_ = 0;
    std::vector<std::byte> piece_;
};

}  // namespace dimmer
