// The files of a command, looked at before its work.
#pragma once

#include <dimmer/error.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// `role`: how messages call it, e.g. "PACK" or "--json". A path that is empty or "-" is no file.
struct NamedFile {
    std::string role;
    std::filesystem::path path;
    bool folder = false;  // files are written into it; it is made when missing
};

// Adds files that belong to the one of `role`, as "a file of ROLE".
void addFilesOf(const std::string& role, const std::vector<std::filesystem::path>& paths,
                std::vector<NamedFile>& files);

// The files that are in `folder` by names that `isOne` takes; none where there is no folder.
std::vector<std::filesystem::path> filesIn(const std::filesystem::path& folder, bool (*isOne)(std::string_view name));

// An error where an output is an input or another output too, by whatever name or link, or cannot be written. Devices
// and pipes may be both: nothing in them is lost.
Expected<void> checkFiles(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

}  // namespace dimmer::cook
