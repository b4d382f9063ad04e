#include <cache/store.h>

#include <pack/decompress.h>
#include <write/pack_writer.h>

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <fstream>

namespace dimmer::cook {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view extension = ".entry";
// Level 1 packs the floats of light to some 80 % at several hundred MB/s; higher levels cost more time than they save.
constexpr int compression_level = 1;
// A file without its final name that is older than this belongs to no cook that still runs.
constexpr auto abandoned_after = std::chrono::hours(24);

// What the name of a file in the folder says of it. A folder may hold files of other people: KIND-KEY.entry is ours,
// and while it is written six characters more.
enum class Named { Other, Entry, Unfinished };
Named named(std::string_view name) {
    const auto all = [](std::string_view text, std::string_view of) {
        return text.find_first_not_of(of) == std::string_view::npos;
    };
    const size_t dash = name.find('-'), dot = name.find('.');
    if (dash == 0 || dash == std::string_view::npos || dot == std::string_view::npos || dot < dash) return Named::Other;
    const std::string_view kind = name.substr(0, dash), key = name.substr(dash + 1, dot - dash - 1),
                           rest = name.substr(dot);
    const bool ours = all(kind, "abcdefghijklmnopqrstuvwxyz") && key.size() == 32 && all(key, "0123456789abcdef") &&
                      rest.starts_with(extension);
    if (!ours) return Named::Other;
    if (rest == extension) return Named::Entry;
    const std::string_view more = rest.substr(extension.size());
    return more.size() == 7 && more[0] == '.' && more.find('.', 1) == std::string_view::npos ? Named::Unfinished
                                                                                             : Named::Other;
}

struct EntryHeader {
    std::array<char, 8> magic;
    uint64_t stored_bytes, real_bytes;
    uint64_t hash_high, hash_low;  // XXH3, 128 bits, of the stored bytes, seeded with the entry's name
};
constexpr std::array<char, 8> entry_magic = {'D', 'I', 'M', 'C', 'A', 'C', 'H', '2'};

// Nothing where there is no such file: a folder opens, and claims to be without end; a pipe is waited for to be opened
// by somebody else.
std::optional<std::vector<std::byte>> readFile(const fs::path& path) {
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) return std::nullopt;
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) return std::nullopt;
    std::vector<std::byte> bytes(static_cast<size_t>(std::max<std::streamoff>(file.tellg(), 0)));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<size_t>(file.gcount()));
    return bytes;
}

// One entry under another's name is as good as damaged.
XXH128_hash_t hashOf(std::span<const std::byte> stored, std::string_view name) {
    return XXH3_128bits_withSeed(stored.data(), stored.size(), XXH3_64bits(name.data(), name.size()));
}

std::optional<std::vector<std::byte>> decode(std::span<const std::byte> file, std::string_view name) {
    EntryHeader header{};
    if (file.size() < sizeof(header)) return {};
    std::memcpy(&header, file.data(), sizeof(header));
    const auto stored = file.subspan(sizeof(header));
    if (header.magic != entry_magic || stored.size() != header.stored_bytes) return {};
    const XXH128_hash_t hash = hashOf(stored, name);
    if (hash.high64 != header.hash_high || hash.low64 != header.hash_low) return {};
    thread_local Decompressor decompressor;
    return decompressor.run(stored, header.real_bytes);
}

std::vector<std::byte> encode(std::span<const std::byte> bytes, std::string_view name) {
    std::vector<std::byte> file(sizeof(EntryHeader) + ZSTD_compressBound(bytes.size()));
    std::byte* stored = file.data() + sizeof(EntryHeader);
    const size_t size =
        ZSTD_compress(stored, file.size() - sizeof(EntryHeader), bytes.data(), bytes.size(), compression_level);
    if (ZSTD_isError(size)) throw std::bad_alloc();  // all else fits
    const XXH128_hash_t hash = hashOf({stored, size}, name);
    const EntryHeader header{entry_magic, size, bytes.size(), hash.high64, hash.low64};
    std::memcpy(file.data(), &header, sizeof(header));
    file.resize(sizeof(header) + size);
    return file;
}

}  // namespace

Expected<CacheStore> CacheStore::open(fs::path folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (!fs::is_directory(folder, error))
        return fail(ErrorCode::Io, fmt::format("{}: the cache's folder cannot be made", folder.string()));
    return CacheStore(std::move(folder));
}

std::string CacheStore::nameOf(std::string_view kind, const Key& key) {
    return fmt::format("{}-{}{}", kind, key.hex(), extension);
}

void CacheStore::markUsed(const std::string& name) const {
    const fs::path file = fs::path(name).filename();  // nothing outside of the folder
    std::error_code ignored;
    if (named(name) == Named::Entry) fs::last_write_time(folder_ / file, fs::file_time_type::clock::now(), ignored);
}

Entry CacheStore::find(std::string_view kind, const Key& key) const {
    const std::string name = nameOf(kind, key);
    // One look alone: between two another cook's trim may remove it.
    const auto content = readFile(folder_ / name);
    if (!content) return {};
    auto bytes = decode(*content, name);
    if (!bytes) return {Find::Damaged, {}};
    markUsed(name);
    return {Find::Hit, std::move(*bytes)};
}

Expected<void> CacheStore::keep(std::string_view kind, const Key& key, std::span<const std::byte> bytes) const {
    // Not flushed: what a power cut leaves half written is found to be damaged.
    const std::string name = nameOf(kind, key);
    // A pipe would be written to, and waited for; a folder fails by itself.
    std::error_code ignored;
    const auto there = fs::status(folder_ / name, ignored);
    if (fs::exists(there) && !fs::is_regular_file(there) && !fs::is_directory(there))
        return fail(ErrorCode::Io, fmt::format("{}: it is no file; remove it", (folder_ / name).string()));
    return writeFileAtomically(folder_ / name, encode(bytes, name), Flush::No);
}

void CacheStore::remove(const std::string& name) const {
    std::error_code ignored;  // another cook's trim may have been first
    fs::remove(folder_ / name, ignored);
}

std::vector<std::string> CacheStore::trim(uint64_t bytes_max) const {
    struct File {
        fs::path path;
        fs::file_time_type used;
        uint64_t bytes;
    };
    std::vector<File> files;
    uint64_t sum = 0;
    std::error_code error;
    const auto now = fs::file_time_type::clock::now();
    for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
        // Others may remove files at the same time: what cannot be asked about is gone.
        std::error_code gone;
        const File file{it->path(), it->last_write_time(gone), it->file_size(gone)};
        const Named what = gone ? Named::Other : named(file.path.filename().string());
        if (what == Named::Unfinished && now - file.used > abandoned_after) fs::remove(file.path, gone);
        if (what != Named::Entry) continue;
        files.push_back(file);
        sum += file.bytes;
    }
    std::ranges::sort(files,
                      [](const File& a, const File& b) { return std::tie(a.used, a.path) < std::tie(b.used, b.path); });
    std::vector<std::string> removed;
    for (size_t i = 0; i < files.size() && sum > bytes_max; ++i) {
        fs::remove(files[i].path, error);
        sum -= files[i].bytes;
        removed.push_back(files[i].path.filename().string());
    }
    return removed;
}

}  // namespace dimmer::cook
