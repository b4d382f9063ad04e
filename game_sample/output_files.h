// The files that a run leaves: never one of its own inputs, whole or not at all, and none of an earlier run.
#pragma once

#include <dimmer/error.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::sample {

std::filesystem::path frameFile(const std::filesystem::path& folder, uint32_t frame);
std::filesystem::path costFile(const std::filesystem::path& folder);

// Before the work: errors where the picture would be one of the inputs, or cannot be made where it is wanted. Empty
// inputs, and an empty picture, are none.
Expected<void> checkPicture(const std::filesystem::path& picture, const std::vector<std::filesystem::path>& inputs);

// A folder for frames: made when missing, rid of what an earlier run left. Errors where an input has a name that a run
// writes to or removes; then nothing has happened.
Expected<void> prepareFolder(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& inputs);

// Half a file is never at `path`.
Expected<void> writeFile(const std::filesystem::path& path, std::string_view bytes);

}  // namespace dimmer::sample
