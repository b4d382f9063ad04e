// Files that hold what a cook found out, by the hash of what it depends on.
#pragma once

#include <cache/key.h>
#include <dimmer/error.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::cook {

enum class Find {
    Hit,
    Missing,
    Damaged,  // there, but not what was written under this name: its hash is another
};

struct Entry {
    Find find = Find::Missing;
    std::vector<std::byte> bytes;
};

// A folder of entries. Any number of processes may use one at the same time: entries appear whole, under names that say
// what is in them, and are never changed. Nothing that goes wrong with a cache fails a cook.
class CacheStore {
   public:
    // Makes the folder where there is none.
    static Expected<CacheStore> open(std::filesystem::path folder);

    // Marks the entry as used just now.
    Entry find(std::string_view kind, const Key& key) const;
    // As find() marks it, for those that say the name of an entry without its content; others are passed over.
    void markUsed(const std::string& name) const;
    static std::string nameOf(std::string_view kind, const Key& key);
    Expected<void> keep(std::string_view kind, const Key& key, std::span<const std::byte> bytes) const;

    void remove(const std::string& name) const;

    // Removes the entries that were used least recently until all together have at most `bytes_max`, and what killed
    // cooks left behind. Returns the names of those that were removed.
    std::vector<std::string> trim(uint64_t bytes_max) const;

    const std::filesystem::path& folder() const { return folder_; }

   private:
    explicit CacheStore(std::filesystem::path folder) : folder_(std::move(folder)) {}

    std::filesystem::path folder_;
};

}  // namespace dimmer::cook
