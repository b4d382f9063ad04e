// The files of a command, looked at before its work.
#pragma once

#include <dimmer/error.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// `role`: how messages call it, e.g. "PACK" or "--json". An empty path is no file; "-" is a standard stream of an
// input, and of an output that `prints`; others must not have it.
struct NamedFile {
    std::string role;
    std::filesystem::path path;
    bool folder = false;  // files are written into it; it is made when missing
    bool prints = false;
};

// An output that "-" sends to stdout.
inline NamedFile printed(const std::string& role, const std::filesystem::path& path) {
    return {.role = role, .path = path, .prints = true};
}

// Adds files that belong to the one of `role`, as "a file of ROLE".
void addFilesOf(const std::string& role, const std::vector<std::filesystem::path>& paths,
                std::vector<NamedFile>& files);

// The files that are in `folder` by names that `isOne` takes; none where there is no folder.
std::vector<std::filesystem::path> filesIn(const std::filesystem::path& folder, bool (*isOne)(std::string_view name));

// Removes what an earlier run wrote there as its --json, so that nobody takes it for this one's. It is known by these
// keys; anything else of that name stays.
Expected<void> removeEarlierJson(const std::string& file, const std::vector<std::string>& keys);

// An error where an output is an input or another output too, by whatever name or link, or cannot be written. Devices
// and pipes may be both: nothing in them is lost.
Expected<void> checkFiles(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

}  // namespace dimmer::cook
